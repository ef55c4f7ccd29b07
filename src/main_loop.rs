//! What the main loop does with or without a console: deferred requests of the Modbus master, the end of safe mode, sleep.
//!
//! `foreground.rs` is the main loop with the console, `unattended.rs` the one without.

use core::cell::RefCell;

use clino_bus::{DriverEnable, Instant};
use clino_gateway::Bus;
use clino_gateway::settings::SettingsPart;
use clino_modbus::Settings;
use clino_modbus::binding::DeferredRequest;
use clino_recovery::{Mode, Start};
use rtic::Mutex;

use crate::app::idle::SharedResources;
use crate::config_store::ConfigStore;
use crate::quiet::{self, Kept, Quiet, Work};
use crate::{clock, console, params, ports, shared, start};

/// Resources that the main loop shares with the levels.
pub struct Common<'a> {
    pub shared: RefCell<SharedResources<'a>>,
    pub writer: RefCell<&'a mut console::Writer>,
}

impl<'a> Common<'a> {
    pub fn with<R>(&self, work: impl FnOnce(&mut SharedResources<'a>) -> R) -> Option<R> {
        self.shared.try_borrow_mut().ok().map(|mut shared| work(&mut shared))
    }

    pub fn gateway<R>(&self, work: impl FnOnce(&mut clino_gateway::Gateway) -> R) -> Option<R> {
        self.with(|shared| shared.gateway.lock(|gateway| work(gateway)))
    }

    pub fn kept(&self) -> Kept {
        self.with(|shared| shared.kept.lock(|kept| *kept)).unwrap_or(Kept::UNKNOWN)
    }

    pub fn settings(&self) -> Settings {
        self.with(|shared| shared.settings.lock(|it| *it)).unwrap_or(params::MODBUS)
    }

    pub fn has_command(&self) -> bool {
        self.with(|shared| shared.has_command.lock(|it| *it)).unwrap_or(false)
    }

    pub fn is_unsaved(&self) -> bool {
        let known =
            SettingsPart::together(|part| self.gateway(|gateway| gateway.fingerprint_of(part)).unwrap_or(0));
        self.kept().is_unsaved((known, self.settings()))
    }

    pub fn driver_enable(&self, bus: Bus) -> DriverEnable {
        self.with(|shared| ports::driver_enable(bus, &mut shared.t7, &mut shared.isu)).unwrap_or_default()
    }

    pub fn drain(&self) {
        while !self.with(|shared| shared.console.lock(|port| port.is_drained())).unwrap_or(true) {}
    }
}

impl Quiet for &Common<'_> {
    fn while_silent(&mut self, work: &mut dyn Work) -> bool {
        self.with(|shared| {
            let SharedResources { gateway, settings, t7, isu, uplink, .. } = shared;
            gateway.lock(|gateway| {
                let driving = t7.lock(|port| port.is_driving())
                    || isu.lock(|port| port.is_driving())
                    || uplink.lock(|port| port.is_driving());
                if !driving {
                    settings.lock(|settings| work.run(gateway, settings));
                }
                !driving
            })
        })
        .unwrap_or(false)
    }

    fn note(&mut self, kept: Kept) {
        self.with(|shared| shared.kept.lock(|place| *place = kept));
    }
}

/// Leaves safe mode when it has lasted long enough.
pub fn end_safe_mode(start: &Start) {
    if start.mode != Mode::Normal && clock::now().since(Instant::ZERO) >= params::SAFE_MODE {
        start::retry();
    }
}

/// Carries out the request that the Modbus level has deferred; returns whether there was one. A function of its own: its stack
/// is not below the console's.
#[inline(never)]
pub fn carry_out_deferred(common: &Common<'_>, store: &mut ConfigStore) -> bool {
    let Some(request) = common.with(|shared| shared.deferred.lock(Option::take)).flatten() else {
        return false;
    };
    let mut quiet = common;
    let well = match request {
        DeferredRequest::Save => store.save(&mut quiet).is_ok(),
        DeferredRequest::FactoryReset => store.factory_reset(&mut quiet).is_ok(),
        // The answer to the master comes first.
        DeferredRequest::Reboot => quiet::restart(&mut quiet),
    };
    common.with(|shared| shared.done.lock(|done| *done = Some(well)));
    shared::wake_modbus();
    true
}
