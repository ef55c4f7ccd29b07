//! The board's own classes: the emulator constructs them from the board text, and each finds here what belongs to it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use clino_segment::wire::Wire;
use rsemu::core::Result;
use rsemu::core::error::Error;
use rsemu::core::props::Props;
use rsemu::core::registry::Registry;
use rsemu::machine::{BuildOptions, Instance};

use crate::cpu::{self, Cpu};
use crate::crystal;
use crate::incident::Chronicle;
use crate::model::BoardModel;
use crate::oscillators::CrystalLife;
use crate::ports::{self, Ports, SerialPort};
use crate::pwm::{self, PwmDevice, PwmWaveform, Source};
use crate::reception::Receptions;
use crate::timeline::{Actor, Timeline, lock};
use crate::usart::{self, Connections, UsartDevice};
use crate::watchdog;
use crate::wrapped::Wrapped;

/// What the constructors of the board's own classes take from the assembly, and what they leave for it.
pub(super) struct Parts {
    model: BoardModel,
    timeline: Arc<Timeline>,
    chronicle: Arc<Chronicle>,
    life: CrystalLife,
    wires: Mutex<BTreeMap<&'static str, Box<dyn Wire>>>,
    waveforms: Mutex<BTreeMap<u64, Box<dyn PwmWaveform>>>,
    /// What arrives at each serial port.
    pub receptions: BTreeMap<&'static str, Receptions>,
    // Left for the assembly.
    pub crystal: Mutex<Option<Arc<crystal::Pins>>>,
    pub cpu: Mutex<Option<Arc<Cpu>>>,
    pub actors: Mutex<Vec<Arc<dyn Actor>>>,
    pub sources: Mutex<Vec<Arc<Source>>>,
}

impl Parts {
    /// Nothing is taken yet, and nothing left.
    pub fn new(
        model: BoardModel,
        timeline: Arc<Timeline>,
        chronicle: Arc<Chronicle>,
        life: CrystalLife,
        ports: Ports,
    ) -> Parts {
        let Ports { t7, isu, console, modbus, pwm: [pwm1, pwm2] } = ports;
        let wires = [("t7", t7), ("isu", isu), ("console", console), ("modbus", modbus)];
        Parts {
            model,
            timeline,
            chronicle,
            life,
            wires: Mutex::new(BTreeMap::from(wires)),
            waveforms: Mutex::new(BTreeMap::from([(1, pwm1), (2, pwm2)])),
            receptions: SerialPort::ALL.map(|port| (port.name(), Receptions::default())).into(),
            crystal: Mutex::new(None),
            cpu: Mutex::new(None),
            actors: Mutex::new(Vec::new()),
            sources: Mutex::new(Vec::new()),
        }
    }

    fn build_cpu(&self, props: &Props) -> Result<Arc<Cpu>> {
        let cpu = Arc::new(Cpu::new(props, Arc::clone(&self.timeline), Arc::clone(&self.chronicle))?);
        *lock(&self.cpu) = Some(Arc::clone(&cpu));
        Ok(cpu)
    }

    fn build_crystal(&self, stock: Arc<dyn Instance>) -> Result<Arc<Wrapped<crystal::Pins>>> {
        let controller = crystal::at(stock, self.life, self.model.is_fed(), Arc::clone(&self.chronicle))?;
        *lock(&self.crystal) = Some(controller.front());
        lock(&self.actors).push(controller.front());
        Ok(Arc::new(controller))
    }

    fn build_usart(&self, props: &Props) -> Result<Arc<UsartDevice>> {
        let name = props.require("port")?.to_str("port")?;
        let wire = lock(&self.wires).remove(name);
        let receptions = self.receptions.get(name).cloned();
        let (Some((clock, tx, rx)), Some(wire), Some(receptions)) =
            (ports::pins(self.model, name), wire, receptions)
        else {
            return Err(Error::Property(format!("there is no serial port `{name}`, or it is taken")));
        };
        let connections = Connections { clock, tx, rx, wire, receptions };
        let device = Arc::new(UsartDevice::new(connections, Arc::clone(&self.timeline)));
        lock(&self.actors).push(device.actor());
        Ok(device)
    }

    fn build_pwm(&self, props: &Props) -> Result<Arc<PwmDevice>> {
        let channel = props.require("channel")?.to_uint("channel")?;
        let Some(waveform) = lock(&self.waveforms).remove(&channel) else {
            return Err(Error::Property(format!("there is no PWM channel {channel}, or it is taken")));
        };
        let pin = ports::pwm_pin(channel);
        let source = Arc::new(Source::new(waveform, pin, Arc::clone(&self.timeline)));
        lock(&self.actors).push(Arc::clone(&source) as Arc<dyn Actor>);
        lock(&self.sources).push(Arc::clone(&source));
        Ok(Arc::new(PwmDevice(source)))
    }
}

/// Adds the board's own classes, the rules of the watchdog, and the crystal at the clock controller.
pub(super) fn offer(parts: &Arc<Parts>, registry: &mut Registry, options: &mut BuildOptions) -> Result<()> {
    for class in [cpu::class(), usart::class(), pwm::class()] {
        registry.add(class)?;
    }
    let (a, b, c) = (Arc::clone(parts), Arc::clone(parts), Arc::clone(parts));
    options.bindings.bind(cpu::CLASS_NAME, move |props| Ok(a.build_cpu(props)?))?;
    options.bindings.bind(usart::CLASS_NAME, move |props| Ok(b.build_usart(props)?))?;
    options.bindings.bind(pwm::CLASS_NAME, move |props| Ok(c.build_pwm(props)?))?;
    if let Some(stock) = options.bindings.get(watchdog::STOCK) {
        options.bindings.replace(watchdog::STOCK, move |props| Ok(Arc::new(watchdog::ruled(stock(props)?)?)));
    }
    if let Some(stock) = options.bindings.get(crystal::STOCK) {
        let d = Arc::clone(parts);
        options.bindings.replace(crystal::STOCK, move |props| Ok(d.build_crystal(stock(props)?)?));
    }
    for schema in [cpu::schema(), usart::schema(), pwm::schema(), crystal::schema()] {
        options.classes.insert(schema);
    }
    Ok(())
}
