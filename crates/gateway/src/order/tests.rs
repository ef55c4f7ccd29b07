//! Every order in every degraded mode.

use clino_bus::{Instant, Serial, Timing};
use clino_codec::isu::eeprom::Change;
use clino_codec::t7::{Address, Axis, BaudRate};
use clino_codec::{isu, pwm};
use clino_commissioning::isu::Module;
use clino_commissioning::t7::{Device, DeviceSetting, Rates};

use super::*;
use crate::task::isu::Task as OfIsu;
use crate::task::t7::Task as OfT7;
use crate::{Bus, BusChange, Gateway, Requester, Settings, SlotConfig};
use crate::{INTERNAL_OSCILLATOR_PPM, UART_TOLERANCE_PPM};

fn gateway(degraded: DegradedMode) -> Gateway {
    let (t7, isu) = (Timing::t7(Serial::T7_DEFAULT), Timing::isu());
    let mut gateway = Gateway::new(&Settings::new(&[], t7, isu), pwm::Limits::new(84_000_000));
    gateway.degrade(degraded);
    gateway
}

fn address(number: u8) -> Address {
    Address::new(number).unwrap()
}

/// Orders that change nothing in a sensor.
fn reading() -> [Order; 4] {
    let module = Module::at(isu::Address::new(3).unwrap()).unwrap();
    [
        Order::T7(OfT7::Identify(Device::at(address(5)).unwrap())),
        Order::T7(OfT7::Sweep(Rates::ALL)),
        Order::Isu(OfIsu::Identify(module)),
        Order::Isu(OfIsu::Reset(module)),
    ]
}

/// Orders that do.
fn writing() -> [Order; 7] {
    let device = Device::at(address(5)).unwrap();
    let module = Module::at(isu::Address::new(3).unwrap()).unwrap();
    [
        Order::T7(OfT7::Zero(device, Axis::Two)),
        Order::T7(OfT7::Set(device, DeviceSetting::Damping(100))),
        Order::T7(OfT7::Address { from: address(5), to: address(6) }),
        Order::T7(OfT7::Baud(device, BaudRate::B9600)),
        Order::Isu(OfIsu::ResetNull(module)),
        Order::Isu(OfIsu::Program(module, Change::NullPosition(7))),
        Order::Isu(OfIsu::Repair(module)),
    ]
}

/// Orders that concern the gateway alone.
fn own() -> [Order; 5] {
    [
        Order::Slot { slot: 7, config: SlotConfig::OFF },
        Order::Bus { bus: Bus::T7, change: BusChange { baud: Some(9_600), ..BusChange::NONE } },
        Order::Cancel(Bus::T7),
        Order::Acknowledge(None),
        Order::ClearExtremes(Some(47)),
    ]
}

#[test]
fn each_degraded_mode_refuses_its_own_orders() {
    for (degraded, reads, writes) in [
        (DegradedMode::None, true, true),
        (DegradedMode::InexactClock, true, false),
        (DegradedMode::NoBuses, false, false),
    ] {
        let carried_out = |order| gateway(degraded).carry_out(order, Requester::Console);
        let expected = |allowed| if allowed { Ok(()) } else { Err(Refusal::Degraded(degraded)) };
        for order in reading() {
            assert_eq!(carried_out(order), expected(reads), "{degraded:?} {order:?}");
        }
        for order in writing() {
            assert_eq!(carried_out(order), expected(writes), "{degraded:?} {order:?}");
        }
        for order in own() {
            assert_eq!(carried_out(order), Ok(()), "{degraded:?} {order:?}");
        }
    }
}

#[test]
fn what_is_refused_is_not_begun_and_its_own_fault_comes_first() {
    let mut gateway = gateway(DegradedMode::NoBuses);
    for order in reading() {
        assert!(gateway.carry_out(order, Requester::Console).is_err());
    }
    gateway.poll(Bus::T7, Instant::from_micros(1_000_000), |_| panic!("nothing is asked"));
    assert_eq!((gateway.progress(Bus::T7), gateway.progress(Bus::Isu)), (None, None));
    let wrong = Order::T7(OfT7::Set(Device::at(address(5)).unwrap(), DeviceSetting::Damping(5_001)));
    assert!(matches!(gateway.carry_out(wrong, Requester::Console), Err(Refusal::T7(_))));
}

#[test]
fn the_figures_are_those_of_the_documents() {
    // DS8626 table 39: -8 % at the worst; RM0090 section 30.3.5: 3.33 %.
    assert_eq!((INTERNAL_OSCILLATOR_PPM, UART_TOLERANCE_PPM), (80_000, 33_300));
}
