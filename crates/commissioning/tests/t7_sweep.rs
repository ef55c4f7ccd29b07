//! Finding T7s: by sweeping all addresses and bit rates, and by asking all at once.

mod common;

use std::sync::{Arc, Mutex};

use clino_bus::{Duration, Serial};
use clino_codec::t7::{Axis, BaudRate, EncodeError, Opcode, Request, Response};
use clino_commissioning::t7::{AskAll, Cause, Found, Heard, Rates, Sweep, Swept};
use clino_segment::{Noise, Probability};
use clino_sim::latency::Latency;
use clino_sim::t7 as sim;
use common::spoil::Fault::{Byte, Cut, Late, Lost, Twice};
use common::spoil::Spoil;
use common::t7::{Shared, address, at, at_rate, bench, on_line, station, three_axes};
use common::{run, run_and};

fn devices(events: &[Found]) -> Vec<(u8, u32, u32)> {
    let device = |event: &Found| match event {
        Found::Device { address, rate, information } => {
            Some((address.get(), rate.bits_per_second(), information.serial))
        }
        Found::Suspect { .. } => None,
    };
    events.iter().filter_map(device).collect()
}

#[test]
fn a_sweep_of_one_rate_finds_every_address() {
    let sensors = [at(1), at(50), at(100), at(127)];
    let mut bench = bench(&sensors.each_ref());
    let run = run(&mut bench, Sweep::new(Serial::T7_DEFAULT, Rates::NONE.and(BaudRate::B115200)));
    assert_eq!(run.result.unwrap(), Swept { devices: 4, suspects: 0, asked: 101, complete: true });
    let found = devices(&run.events);
    assert_eq!(found, [1, 50, 100, 127].map(|number| (number, 115_200, 1000 + u32::from(number))));
    assert!(run.rates.is_empty());
    // 97 silent addresses at 2.44 ms, and what is asked and answered otherwise.
    assert!((240..300).contains(&run.took.as_millis()), "{:?}", run.took);
}

#[test]
fn a_sweep_of_all_rates_finds_all_devices_and_returns() {
    let sensors = [at_rate(3, 0), at_rate(4, 1), at_rate(5, 2), at_rate(6, 3), at_rate(7, 4)];
    let mut bench = bench(&sensors.each_ref());
    let run = run(&mut bench, Sweep::new(Serial::T7_DEFAULT, Rates::ALL));
    let swept = run.result.unwrap();
    assert_eq!((swept.devices, swept.asked, swept.complete), (5, 505, true));
    assert_eq!(
        devices(&run.events),
        [(3, 115_200, 1003), (4, 57_600, 1004), (5, 38_400, 1005), (6, 19_200, 1006), (7, 9_600, 1007)]
    );
    assert_eq!(run.rates, [57_600, 38_400, 19_200, 9_600, 115_200]);
    // The device at home hears again at once.
    let answer = bench.ask(address(3), &Request::GetDamping).result.unwrap();
    assert!(matches!(answer.response, Response::GetDamping { damping_ms: 50 }));
    println!("five rates took {} ms, {} suspects", run.took.as_millis(), swept.suspects);
    assert!(run.took < Duration::from_micros(7_000_000), "{:?}", run.took);
}

#[test]
fn a_line_at_home_elsewhere_is_swept_there_first() {
    let sensors = [at_rate(3, 0), at_rate(4, 4)];
    let mut bench = bench(&sensors.each_ref());
    let home = Serial { baud: 9_600 };
    let timing = clino_bus::Timing::t7(home);
    bench.port.set_serial(home, timing.guard);
    bench.master.set_timing(timing);
    let rates = Rates::NONE.and(BaudRate::B115200).and(BaudRate::B9600);
    let run = run(&mut bench, Sweep::new(home, rates));
    assert_eq!(devices(&run.events), [(4, 9_600, 1004), (3, 115_200, 1003)]);
    assert_eq!(run.rates, [115_200, 9_600]);
}

#[test]
fn a_cancel_at_any_time_brings_the_line_home() {
    // Each address at home, a call, each address at the second rate, and calls at the others.
    for after in [0, 1, 50, 101, 102, 103, 150, 203] {
        let sensors = [at_rate(3, 0), at_rate(4, 1)];
        let mut bench = bench(&sensors.each_ref());
        let sweep = Sweep::new(Serial::T7_DEFAULT, Rates::ALL);
        let run = run_and(&mut bench, sweep, |runner, requests| {
            if requests == after {
                runner.cancel();
            }
        });
        let swept = run.result.unwrap();
        assert!(!swept.complete && u32::from(swept.asked) <= after, "{swept:?} after {after}");
        assert!(run.rates.last().is_none_or(|&rate| rate == 115_200), "{:?}", run.rates);
        assert!(bench.ask(address(3), &Request::GetDamping).result.is_ok(), "after {after}");
    }
}

#[test]
fn a_rate_at_which_no_device_answers_costs_three_calls() {
    let sensors = [at_rate(3, 0)];
    let mut bench = bench(&sensors.each_ref());
    let run = run(&mut bench, Sweep::new(Serial::T7_DEFAULT, Rates::ALL));
    let swept = run.result.unwrap();
    assert_eq!((swept.devices, swept.asked, swept.complete), (1, 505, true));
    assert_eq!(run.requests, 101 + 4 * 3);
    // 0.26 s for the addresses, five silences of 0.55 s, and 12 calls of 2 ms and their characters.
    assert!(run.took < Duration::from_millis(3_300), "{:?}", run.took);
}

#[test]
fn devices_that_answer_a_call_on_top_of_each_other_are_found_one_by_one() {
    for count in [2, 8, 32] {
        let sensors: Vec<Shared> = (1..=count).map(|address| at_rate(address, 3)).collect();
        let stations = sensors.iter().map(|sensor| station(sensor, Spoil::Nothing, Vec::new())).collect();
        let mut bench = on_line(common::quiet(), stations);
        let run = run(&mut bench, Sweep::new(Serial::T7_DEFAULT, Rates::ALL));
        let found: Vec<u8> = devices(&run.events).iter().map(|&(address, ..)| address).collect();
        assert_eq!(found, (1..=count).collect::<Vec<u8>>());
        assert_eq!(run.requests, 101 + 3 * 3 + 1 + 101, "one call where they are");
    }
}

#[test]
fn a_call_whose_answer_is_spoilt_leaves_nothing_out() {
    for fault in [Lost, Cut(1), Byte { index: 3, mask: 0x10 }, Late(5_000_000), Late(30_000_000), Twice] {
        let sensor = at_rate(9, 4);
        let mut bench = on_line(common::quiet(), vec![station(&sensor, Spoil::Answer(0, fault), Vec::new())]);
        let run = run(&mut bench, Sweep::new(Serial::T7_DEFAULT, Rates::ALL));
        assert_eq!(devices(&run.events), [(9, 9_600, 1009)], "{fault:?}");
    }
}

#[test]
fn a_sweep_in_several_passes_asks_every_address_without_a_call() {
    let sensors = [at_rate(3, 0), at_rate(9, 4)];
    let mut bench = bench(&sensors.each_ref());
    let run = run(&mut bench, Sweep::new(Serial::T7_DEFAULT, Rates::ALL).passes(2));
    assert_eq!(devices(&run.events), [(3, 115_200, 1003), (9, 9_600, 1009)]);
    let swept = run.result.unwrap();
    assert_eq!((swept.asked, swept.complete), (1_010, true));
    assert_eq!(run.requests, 5 * 101 * 2 - 2);
}

#[test]
fn two_at_one_address_are_a_suspect() {
    let sensors = [at(8), three_axes(8), at(9)];
    let mut bench = bench(&sensors.each_ref());
    let run = run(&mut bench, Sweep::new(Serial::T7_DEFAULT, Rates::NONE.and(BaudRate::B115200)));
    assert_eq!(run.result.unwrap(), Swept { devices: 1, suspects: 1, asked: 101, complete: true });
    assert!(matches!(run.events[0], Found::Suspect { address, .. } if address.get() == 8));
    assert_eq!(devices(&run.events), [(9, 115_200, 1009)]);
}

#[test]
fn noise_hides_no_device_and_invents_none() {
    let mut settings = common::quiet();
    settings.noise = Noise { bit_errors: Probability::new(2e-4).unwrap(), ..Noise::default() };
    let sensors: Vec<Shared> = (1..=32).map(at).collect();
    let stations = sensors.iter().map(|sensor| station(sensor, Spoil::Nothing, Vec::new())).collect();
    let mut bench = on_line(settings, stations);
    let sweep = Sweep::new(Serial::T7_DEFAULT, Rates::NONE.and(BaudRate::B115200)).passes(4);
    let run = run(&mut bench, sweep);
    let mut found: Vec<u8> = devices(&run.events).iter().map(|&(address, ..)| address).collect();
    found.sort_unstable();
    assert_eq!(found, (1..=32).collect::<Vec<u8>>());
    assert!(devices(&run.events).iter().all(|&(address, _, serial)| serial == 1000 + u32::from(address)));
    let swept = run.result.unwrap();
    assert_eq!((swept.devices, swept.suspects, swept.asked), (32, 0, 404));
}

fn with_latency(address: u8, serial: u32, latency: u64) -> Shared {
    let identity = sim::Identity { serial, ..sim::Identity::default() };
    let store = sim::StoredSettings { address, ..sim::StoredSettings::default() };
    let options = sim::Options { get_latency: Latency::fixed(latency), ..sim::Options::default() };
    Arc::new(Mutex::new(sim::T7::new(identity, store, options).unwrap()))
}

fn ask_all() -> AskAll {
    AskAll::new(Request::GetDamping, AskAll::window(Serial::T7_DEFAULT)).unwrap()
}

#[test]
fn all_who_answer_apart_are_heard_from() {
    // 6 characters at 115200 are 521 µs.
    let sensors = [with_latency(3, 3, 100_000), with_latency(4, 4, 900_000), with_latency(127, 5, 1_700_000)];
    let mut bench = bench(&sensors.each_ref());
    let run = run(&mut bench, ask_all());
    let from = run.events.iter().map(|heard| match heard {
        Heard::Answer(answer) => answer.address.get(),
        Heard::Collision(fault) => panic!("{fault:?}"),
    });
    assert_eq!(from.collect::<Vec<_>>(), [3, 4, 127]);
    let collected = run.result.unwrap();
    assert_eq!((collected.answers, collected.collisions), (3, 0));
}

#[test]
fn answers_on_top_of_each_other_are_a_suspected_collision() {
    let sensors = [with_latency(3, 3, 100_000), with_latency(68, 4, 300_000), with_latency(9, 5, 1_700_000)];
    let mut bench = bench(&sensors.each_ref());
    let run = run(&mut bench, ask_all());
    let collected = run.result.unwrap();
    assert!(collected.collisions > 0, "{:?}", run.events);
    assert!(run.events.iter().any(|heard| matches!(heard, Heard::Answer(a) if a.address.get() == 9)));
    assert!(run.events.iter().any(|heard| matches!(heard, Heard::Collision(_))));
    assert_eq!(u32::try_from(run.events.len()).unwrap(), collected.answers + collected.collisions);
}

#[test]
fn an_empty_line_gives_no_answers() {
    let mut bench = bench(&[]);
    let collected = run(&mut bench, ask_all()).result.unwrap();
    assert_eq!((collected.answers, collected.collisions), (0, 0));
}

#[test]
fn only_short_readings_go_to_all() {
    let window = Duration::from_micros(1_000);
    let refused = AskAll::new(Request::GetAllAngles, window).unwrap_err();
    let too_long = EncodeError::NotForAll { opcode: Opcode::GetAllAngles, response_length: 16 };
    assert_eq!(refused, Cause::Refused(too_long));
    let write = Request::SetDamping { damping_ms: 5 };
    assert_eq!(AskAll::new(write, window).unwrap_err(), Cause::WritesToAll { opcode: Opcode::SetDamping });
    assert!(AskAll::new(Request::GetAngle(Axis::Two), window).is_ok());
}
