//! Changing the bit rate of a T7, and following it.

mod common;

use clino_bus::T7;
use clino_codec::t7::{Axis, BaudRate, Opcode, Request, Response, Status};
use clino_commissioning::t7::{Cause, ChangeBaud, Device};
use clino_commissioning::{SettingChange, SingleDevice};
use clino_sim::fault::AnswerFault as SimFault;
use clino_testkit::rig::Bench;
use common::spoil::{Fault as Spoilt, Spoil};
use common::t7::{Shared, address, at, bench, device, spoilt, store, unplugged};
use common::{MS, run, run_and};

fn change(to: BaudRate) -> ChangeBaud {
    ChangeBaud::new(device(5), BaudRate::B115200, to).unwrap()
}

/// It answers at the rate that the line has.
fn answers(bench: &mut Bench<T7>) -> bool {
    let answer = bench.ask(address(5), &Request::GetAngle(Axis::Two)).result;
    answer.is_ok_and(|answer| matches!(answer.response, Response::GetAngle { .. }))
}

fn index(sensor: &Shared) -> u8 {
    store(sensor).baud_index
}

#[test]
fn the_line_follows_to_every_rate_and_back() {
    for (to, code, baud) in [
        (BaudRate::B57600, 1, 57_600),
        (BaudRate::B38400, 2, 38_400),
        (BaudRate::B19200, 3, 19_200),
        (BaudRate::B9600, 4, 9_600),
    ] {
        let sensor = at(5);
        let mut bench = bench(&[&sensor]);
        let first = run(&mut bench, change(to));
        let report = first.result.unwrap();
        let from = BaudRate::B115200;
        assert_eq!((report.change, report.writes), (SettingChange::Changed { from, to }, 1));
        assert_eq!((index(&sensor), first.rates), (code, vec![baud]));
        assert!(answers(&mut bench), "{to:?}");
        // No byte was sent in the 10 ms in which the device changes.
        assert!(first.took.as_millis() < 100, "{:?}", first.took);
        let back = ChangeBaud::new(device(5), to, from).unwrap();
        assert_eq!(run(&mut bench, back).rates, [115_200]);
        assert!(answers(&mut bench));
        assert_eq!(index(&sensor), 0);
    }
}

#[test]
fn the_same_rate_is_no_change() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    let run = run(&mut bench, change(BaudRate::B115200));
    let report = run.result.unwrap();
    assert_eq!((report.change, report.writes), (SettingChange::Unchanged(BaudRate::B115200), 0));
    assert_eq!((run.rates.len(), run.requests), (0, 1));
}

#[test]
fn a_lone_device_is_followed_too() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    let single = Device::single(SingleDevice::i_have_attached_one_sensor_only());
    let operation = ChangeBaud::new(single, BaudRate::B115200, BaudRate::B9600).unwrap();
    assert_eq!(run(&mut bench, operation).result.unwrap().writes, 1);
    assert!(answers(&mut bench));
}

#[test]
fn a_lost_answer_does_not_lose_the_device() {
    let sensor = at(5);
    let mut bench = spoilt(&sensor, Spoil::Answer(1, Spoilt::Lost));
    let report = run(&mut bench, change(BaudRate::B38400)).result.unwrap();
    assert_eq!(report.writes, 1);
    assert!(answers(&mut bench));
}

#[test]
fn a_command_that_did_not_arrive_falls_back_and_is_written_again() {
    let sensor = at(5);
    // The rate index of the first Set Baud Rate: status checksum error, no change.
    let mut bench = spoilt(&sensor, Spoil::Heard(6, 0x04));
    let run = run(&mut bench, change(BaudRate::B19200));
    assert_eq!(run.result.unwrap().writes, 2);
    assert_eq!(run.rates, [19_200, 115_200, 19_200]);
    assert!(answers(&mut bench));
}

#[test]
fn a_refusal_leaves_device_and_line_at_the_old_rate() {
    let sensor = at(5);
    let refusal = [0x05, 0x03, 0x8F, 0x07, 0x62];
    sensor.lock().unwrap().faults.every = Some((2, SimFault::Instead(refusal.to_vec())));
    let mut bench = spoilt(&sensor, Spoil::Heard(6, 0x04));
    let run = run(&mut bench, change(BaudRate::B9600));
    let failure = run.result.unwrap_err();
    let (opcode, status) = (Opcode::SetBaudRate, Status::FlashEraseError);
    assert_eq!(failure.cause, Cause::Status { opcode, status });
    assert!(run.rates.is_empty());
    sensor.lock().unwrap().faults.every = None;
    assert!(answers(&mut bench));
}

#[test]
fn one_that_is_lost_leaves_the_line_at_its_old_rate() {
    let sensor = at(5);
    let mut bench = spoilt(&sensor, Spoil::AnswersFrom(1, Spoilt::Lost));
    let run = run(&mut bench, change(BaudRate::B9600));
    let failure = run.result.unwrap_err();
    assert!(matches!(failure.cause, Cause::Lost { .. }), "{failure}");
    assert_eq!(run.rates.last(), Some(&115_200));
    assert_eq!(failure.writes, 1);
}

#[test]
fn a_power_cut_at_any_time_ends_at_a_rate_that_is_answered_or_at_the_old_one() {
    let mut ends = [0; 2];
    for cut in (0..60).map(|ms| ms * MS / 2) {
        let sensor = at(5);
        // Off for 100 ms: it is back before the operation gives up.
        let mut bench = unplugged(&sensor, vec![(cut, cut + 100 * MS)]);
        match run(&mut bench, change(BaudRate::B9600)).result {
            Ok(_) => {
                ends[0] += 1;
                assert_eq!(index(&sensor), 4);
                assert!(answers(&mut bench), "cut at {cut}");
            }
            Err(failure) => {
                ends[1] += 1;
                assert_eq!((failure.writes, index(&sensor)), (0, 0), "cut at {cut}: {failure}");
                common::idle_for(&mut bench, clino_bus::Duration::from_millis(1_000));
                assert!(answers(&mut bench), "cut at {cut}");
            }
        }
    }
    // Only a cut before the first answer, which was waited for in vain, is an error.
    assert!(ends[0] > ends[1] && ends[1] > 0, "{ends:?}");
}

#[test]
fn a_cancel_never_strands_the_line() {
    for after in 0..4 {
        let sensor = at(5);
        let mut bench = bench(&[&sensor]);
        let run = run_and(&mut bench, change(BaudRate::B9600), |runner, requests| {
            if requests == after {
                runner.cancel();
            }
        });
        assert_eq!(run.result.is_ok(), index(&sensor) == 4);
        assert!(answers(&mut bench), "after {after}");
    }
}
