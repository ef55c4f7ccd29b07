//! Operations and polling on one line, in turn.

mod common;

use std::collections::HashMap;

use clino_bus::{Duration, Instant, T7, earliest};
use clino_codec::t7::{Axis, Millidegrees, Request, Response};
use clino_commissioning::t7::{ChangeBaud, DeviceSetting, Identify, Set, SetZero};
use clino_commissioning::{Operation, Runner, RunnerAction};
use clino_testkit::rig::Bench;
use common::t7::{address, at, bench, device, store};

/// Polls one node whenever it is its turn, as a gateway does, while an operation runs on another.
struct Gateway {
    polls: u32,
    good: u32,
    /// Exchanges of the operation and of the polling, in order.
    turns: Vec<char>,
}

fn run_beside_polling<O>(bench: &mut Bench<T7>, operation: O) -> (Result<O::Report, O::Error>, Gateway)
where
    O: Operation<Protocol = T7>,
{
    let mut runner = Runner::new(operation);
    let mut gateway = Gateway { polls: 0, good: 0, turns: Vec::new() };
    let mut polling = false;
    let mut poll_next = true;
    loop {
        let now = bench.port.now();
        assert!(now < Instant::from_micros(10_000_000), "it does not end");
        let mut outcome = bench.master.poll(now);
        if outcome.is_none() && !bench.master.is_asking() && !runner.is_asking() {
            let request = Request::GetAngle(Axis::Two);
            let may_poll = !runner.is_exclusive() && bench.master.may_ask(address(9), &request, now);
            if poll_next && may_poll {
                poll_next = false;
                polling = true;
                gateway.polls += 1;
                gateway.turns.push('p');
                let frame = bench.master.begin(address(9), &request, now).unwrap();
                bench.port.submit(frame.as_bytes(), now + Duration::from_micros(10_000)).unwrap();
            } else {
                match runner.poll(&mut bench.master, now) {
                    RunnerAction::Send(frame) => {
                        gateway.turns.push('o');
                        bench.port.submit(frame.as_bytes(), now + Duration::from_micros(10_000)).unwrap();
                    }
                    RunnerAction::Serial(serial) => {
                        let timing = clino_bus::Timing::t7(serial);
                        bench.port.set_serial(serial, timing.guard);
                        bench.master.set_timing(timing);
                    }
                    RunnerAction::Done(result) => return (result, gateway),
                    RunnerAction::Idle => {}
                }
                poll_next = true;
            }
        }
        if outcome.is_none() {
            let wake = runner.poll_at().filter(|&at| at > now && !poll_next);
            let at = earliest(bench.master.poll_at(), wake)
                .unwrap_or(now + Duration::from_micros(100))
                .min(now + Duration::from_micros(100));
            outcome = bench
                .port
                .run(at.max(now + Duration::from_micros(1)))
                .and_then(|event| bench.master.on(event));
        }
        if let Some(outcome) = outcome {
            if polling {
                polling = false;
                let Ok(answer) = outcome.result else { continue };
                let Response::GetAngle { angle, .. } = answer.response else { panic!("{answer:?}") };
                assert_eq!((answer.address.get(), angle), (9, Millidegrees(30_000)));
                gateway.good += 1;
            } else {
                let _ = runner.settle(&outcome);
            }
        }
    }
}

#[test]
fn polling_goes_on_between_the_exchanges() {
    let (sensor, polled) = (at(5), at(9));
    let mut bench = bench(&[&sensor, &polled]);
    let (result, gateway) = run_beside_polling(&mut bench, Identify::new(device(5)).unwrap());
    assert_eq!(result.unwrap().information.serial, 1005);
    assert_eq!(gateway.turns.iter().collect::<String>(), "popopopopop");
    assert_eq!(gateway.good, gateway.polls);
}

#[test]
fn a_pause_is_all_the_pollings() {
    let (sensor, polled) = (at(5), at(9));
    let mut bench = bench(&[&sensor, &polled]);
    let set = Set::new(device(5), DeviceSetting::Damping(1_000)).unwrap();
    assert!(run_beside_polling(&mut bench, set).0.is_ok());
    let (result, gateway) = run_beside_polling(&mut bench, SetZero::new(device(5), Axis::Two));
    assert_eq!(result.unwrap().after, Millidegrees(0));
    assert_eq!(gateway.good, gateway.polls);
    // A second of damping at 2.96 ms a poll.
    assert!(gateway.polls > 300, "{}", gateway.polls);
    // Damping, five angles to see whether it moves, zero, and the angle twice.
    assert_eq!(gateway.turns.iter().filter(|&&turn| turn == 'o').count(), 9);
}

#[test]
fn no_polls_while_the_bit_rate_is_another() {
    let (sensor, polled) = (at(5), at(9));
    let mut bench = bench(&[&sensor, &polled]);
    use clino_codec::t7::BaudRate::{B19200, B115200};
    let (result, gateway) =
        run_beside_polling(&mut bench, ChangeBaud::new(device(5), B115200, B19200).unwrap());
    assert!(result.is_ok());
    assert_eq!(store(&sensor).baud_index, 3);
    let turns: String = gateway.turns.iter().collect();
    // Present, then Set Baud Rate and the look at the new rate with no other exchange in between.
    assert!(turns.trim_end_matches('p').ends_with("oo"), "{turns}");
}

#[test]
fn while_it_asks_it_has_nothing_else_to_do() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    let mut runner = Runner::new(Set::new(device(5), DeviceSetting::Damping(9)).unwrap());
    assert_eq!(runner.poll_at(), Some(Instant::ZERO));
    assert!(matches!(runner.poll(&mut bench.master, Instant::ZERO), RunnerAction::Send(_)));
    assert!(runner.is_asking() && runner.is_exclusive());
    assert_eq!(runner.poll_at(), None);
    for now in 0..3 {
        assert!(matches!(runner.poll(&mut bench.master, Instant::from_micros(now)), RunnerAction::Idle));
    }
    assert_eq!(bench.master.counters().requests, 1);
}

/// What the crate says of itself: several errors, told in words.
#[test]
fn failures_speak() {
    let mut words = HashMap::new();
    let mut empty = bench(&[]);
    let failure = common::run(&mut empty, SetZero::new(device(5), Axis::Two)).result.unwrap_err();
    words.insert("t7", failure.to_string());
    assert!(words["t7"].starts_with("no answer to GetDamping from address 5: NoAnswer"), "{words:?}");
    assert!(words["t7"].ends_with("(writes sent: 0)"), "{words:?}");
    let _: &dyn core::error::Error = &failure;
}
