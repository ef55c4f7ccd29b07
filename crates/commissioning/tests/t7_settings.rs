//! Reading and changing the settings of a T7.

mod common;

use clino_codec::angle::Range;
use clino_codec::t7::{Address, Axis, Direction, EncodeError, Field, Millidegrees, Opcode, Status};
use clino_commissioning::t7::{Cause, Device, DeviceSetting, Fault, Identify, Set, SetZero};
use clino_commissioning::{SettingChange, SingleDevice};
use clino_sim::fault::AnswerFault as SimFault;
use clino_sim::t7 as sim;
use clino_sim::t7::Flash;
use common::t7::{at, bench, device, store, three_axes};
use common::{run, run_and};

#[test]
fn identify_reports_everything_that_is_stored() {
    let sensor = three_axes(9);
    let mut bench = bench(&[&sensor]);
    let run = run(&mut bench, Identify::new(device(9)).unwrap());
    let identity = run.result.unwrap();
    assert_eq!(identity.information.serial, 77);
    assert_eq!(identity.information.product.as_str(), Some("T7-3"));
    assert_eq!((identity.damping_ms, identity.range), (50, Range::Bidirectional));
    assert_eq!(identity.directions, [Direction::Normal; 3]);
    assert_eq!(identity.offsets, [Millidegrees(0); 3]);
    assert_eq!(run.requests, 5);
}

/// A setting, and whether a store holds it.
type Case = (DeviceSetting, fn(&sim::StoredSettings) -> bool);

fn cases() -> [Case; 4] {
    let axis = Axis::Two;
    [
        (DeviceSetting::Offset { axis, offset: Millidegrees(-12_345) }, |store| {
            store.offsets == [0, 0, -12_345]
        }),
        (DeviceSetting::Direction { axis, direction: Direction::Reversed }, |store| {
            store.directions[2] == sim::Direction::Reversed
        }),
        (DeviceSetting::Damping(777), |store| store.damping_ms == 777),
        (DeviceSetting::Range(Range::Unidirectional), |store| {
            store.range == sim::OutputRange::Unidirectional
        }),
    ]
}

#[test]
fn a_difference_is_written_once_and_the_same_again_not_at_all() {
    for (wanted, is_in) in cases() {
        let sensor = at(5);
        let mut bench = bench(&[&sensor]);
        assert!(!is_in(&store(&sensor)));
        let report = run(&mut bench, Set::new(device(5), wanted).unwrap()).result.unwrap();
        assert_eq!(report.writes, 1, "{wanted:?}");
        assert!(matches!(report.change, SettingChange::Changed { to, .. } if to == wanted), "{report:?}");
        assert!(is_in(&store(&sensor)), "{wanted:?}");
        let after = store(&sensor);
        let report = run(&mut bench, Set::new(device(5), wanted).unwrap()).result.unwrap();
        assert_eq!((report.writes, report.change), (0, SettingChange::Unchanged(wanted)));
        // Read, write, read twice; read twice. An offset has to be within the range, which is read first.
        assert_eq!(bench.master.counters().requests, if is_offset(wanted) { 8 } else { 6 });
        assert_eq!(store(&sensor), after);
    }
}

fn is_offset(setting: DeviceSetting) -> bool {
    matches!(setting, DeviceSetting::Offset { .. })
}

#[test]
fn what_is_changed_is_reported_with_what_it_was() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    let report = run(&mut bench, Set::new(device(5), DeviceSetting::Damping(2)).unwrap()).result.unwrap();
    let (from, to) = (DeviceSetting::Damping(50), DeviceSetting::Damping(2));
    assert_eq!(report.change, SettingChange::Changed { from, to });
}

#[test]
fn out_of_range_is_refused_with_the_limits_before_anything_is_sent() {
    for (value, setting) in [
        (1, DeviceSetting::Damping(1)),
        (5_001, DeviceSetting::Damping(5_001)),
        (360_000, DeviceSetting::Offset { axis: Axis::Two, offset: Millidegrees(360_000) }),
        (-180_001, DeviceSetting::Offset { axis: Axis::Two, offset: Millidegrees(-180_001) }),
    ] {
        let (field, min, max) = match setting {
            DeviceSetting::Damping(_) => (Field::Damping, 2, 5_000),
            _ => (Field::Offset, -180_000, 359_999),
        };
        let refused = Set::new(device(5), setting).unwrap_err();
        assert_eq!(refused, EncodeError::OutOfRange { field, value, min, max });
    }
}

#[test]
fn an_offset_outside_the_output_range_is_refused_before_it_is_written() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    let offset = DeviceSetting::Offset { axis: Axis::Two, offset: Millidegrees(180_000) };
    let failure = run(&mut bench, Set::new(device(5), offset).unwrap()).result.unwrap_err();
    let (value, min, max) = (Millidegrees(180_000), Millidegrees(-180_000), Millidegrees(179_999));
    assert_eq!((failure.cause, failure.writes), (Cause::OutOfRange { value, min, max }, 0));
    assert_eq!(bench.master.counters().requests, 1);
    assert!(failure.to_string().contains("-180000..=179999"), "{failure}");
}

#[test]
fn a_refusal_of_the_device_is_an_error_with_its_status() {
    let sensor = at(5);
    sensor.lock().unwrap().flash = Flash::ProgramFails;
    let mut bench = bench(&[&sensor]);
    let setting = DeviceSetting::Direction { axis: Axis::Two, direction: Direction::Reversed };
    let before = store(&sensor);
    let failure = run(&mut bench, Set::new(device(5), setting).unwrap()).result.unwrap_err();
    let (opcode, status) = (Opcode::SetDirection, Status::FlashProgramError);
    assert_eq!((failure.cause, failure.writes), (Cause::Status { opcode, status }, 1));
    assert_eq!(store(&sensor), before);
}

/// Settings of an axis, the values that a single-axis device answers for the axes that it does not have among them.
fn of_axis(axis: Axis) -> [DeviceSetting; 4] {
    [
        DeviceSetting::Offset { axis, offset: Millidegrees(0) },
        DeviceSetting::Offset { axis, offset: Millidegrees(1_000) },
        DeviceSetting::Direction { axis, direction: Direction::Normal },
        DeviceSetting::Direction { axis, direction: Direction::Reversed },
    ]
}

#[test]
fn an_axis_that_a_single_axis_device_does_not_have_is_refused() {
    for axis in [Axis::Zero, Axis::One] {
        let sensor = at(5);
        let mut bench = bench(&[&sensor]);
        let before = store(&sensor);
        let zero = run(&mut bench, SetZero::new(device(5), axis)).result.unwrap_err();
        let text = format!(
            "a single-axis T7 has axis 2 only: its zero for axis {} is no angle (writes sent: 0)",
            axis.get()
        );
        assert_eq!((zero.cause, zero.to_string()), (Cause::NoSuchAxis { axis }, text));
        for wanted in of_axis(axis) {
            let failure = run(&mut bench, Set::new(device(5), wanted).unwrap()).result.unwrap_err();
            assert_eq!((failure.cause, failure.writes), (Cause::NoSuchAxis { axis }, 0), "{wanted:?}");
        }
        // One question for each of the five.
        assert_eq!(bench.master.counters().requests, 5);
        assert_eq!(store(&sensor), before);
    }
}

#[test]
fn every_axis_of_a_three_axis_device_can_be_set() {
    for axis in Axis::ALL {
        let sensor = three_axes(9);
        let mut bench = bench(&[&sensor]);
        for wanted in of_axis(axis) {
            run(&mut bench, Set::new(device(9), wanted).unwrap()).result.unwrap();
        }
        let zeroed = run(&mut bench, SetZero::new(device(9), axis)).result.unwrap();
        assert_eq!((zeroed.after, zeroed.writes), (Millidegrees(0), 1), "{axis:?}");
    }
}

/// A lone device whose address is not known cannot say what it is: the answer is too long.
#[test]
fn an_axis_of_a_lone_device_is_refused_before_anything_is_sent() {
    let sensor = three_axes(9);
    let mut bench = bench(&[&sensor]);
    let single = Device::single(SingleDevice::i_have_attached_one_sensor_only());
    for axis in [Axis::Zero, Axis::One] {
        for wanted in of_axis(axis) {
            assert!(matches!(Set::new(single, wanted), Err(EncodeError::NotForAll { .. })), "{wanted:?}");
        }
        let run = run(&mut bench, SetZero::new(single, axis));
        let failure = run.result.unwrap_err();
        assert!(matches!(failure.cause, Cause::Refused(EncodeError::NotForAll { .. })), "{failure}");
        assert_eq!((run.requests, failure.writes), (0, 0));
    }
}

#[test]
fn what_is_read_back_counts_not_what_the_status_says() {
    let sensor = at(5);
    sensor.lock().unwrap().faults.every = Some((2, SimFault::WrongStatus(8)));
    let mut bench = bench(&[&sensor]);
    let report = run(&mut bench, Set::new(device(5), DeviceSetting::Damping(9)).unwrap()).result.unwrap();
    assert_eq!(report.writes, 1);
    assert_eq!(store(&sensor).damping_ms, 9);
}

#[test]
fn an_empty_line_is_no_answer_after_three_tries() {
    let mut bench = bench(&[]);
    let run = run(&mut bench, Set::new(device(5), DeviceSetting::Damping(9)).unwrap());
    let failure = run.result.unwrap_err();
    assert!(
        matches!(
            failure.cause,
            Cause::NoAnswer { opcode: Opcode::GetDamping, fault: Fault::NoAnswer { .. }, .. }
        ),
        "{failure}"
    );
    assert_eq!((run.requests, failure.writes), (3, 0));
}

#[test]
fn two_at_one_address_are_an_error_and_nothing_is_written() {
    // They differ in what they say, so that it collides.
    let (one, other) = (at(5), three_axes(5));
    let mut bench = bench(&[&one, &other]);
    let before = (store(&one), store(&other));
    let failure = run(&mut bench, Identify::new(device(5)).unwrap()).result.unwrap_err();
    assert!(
        matches!(failure.cause, Cause::NoAnswer { fault: Fault::Bad(_) | Fault::Garbled { .. }, .. }),
        "{failure}"
    );
    assert_eq!((store(&one), store(&other)), before);
}

#[test]
fn zero_waits_out_the_damping_and_reads_zero() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    run(&mut bench, Set::new(device(5), DeviceSetting::Damping(1_500)).unwrap()).result.unwrap();
    let run = run(&mut bench, SetZero::new(device(5), Axis::Two));
    let zeroed = run.result.unwrap();
    assert_eq!((zeroed.before, zeroed.after, zeroed.writes), (Millidegrees(30_000), Millidegrees(0), 1));
    // Damping and margin, then 258 ms to see whether it moves.
    assert!((1_768..1_860).contains(&run.took.as_millis()), "{:?}", run.took);
    assert_eq!(store(&sensor).offsets, [0, 0, -30_000]);
}

#[test]
fn zero_is_not_written_again() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    run(&mut bench, SetZero::new(device(5), Axis::Two)).result.unwrap();
    let zeroed = run(&mut bench, SetZero::new(device(5), Axis::Two)).result.unwrap();
    assert_eq!((zeroed.before, zeroed.writes), (Millidegrees(0), 0));
}

#[test]
fn a_lone_device_needs_no_address() {
    let sensor = at(77);
    let mut bench = bench(&[&sensor]);
    let single = Device::single(SingleDevice::i_have_attached_one_sensor_only());
    run(&mut bench, Set::new(single, DeviceSetting::Damping(123)).unwrap()).result.unwrap();
    run(&mut bench, SetZero::new(single, Axis::Two)).result.unwrap();
    assert_eq!((store(&sensor).damping_ms, store(&sensor).offsets[2]), (123, -30_000));
    // Answers longer than eight are refused for the all-respond address.
    let too_long = Identify::new(single).unwrap_err();
    assert!(matches!(too_long, EncodeError::NotForAll { response_length: 20, .. }), "{too_long}");
    let offset = DeviceSetting::Offset { axis: Axis::Two, offset: Millidegrees(0) };
    assert!(matches!(Set::new(single, offset), Err(EncodeError::NotForAll { response_length: 14, .. })));
    assert!(Device::at(Address::ALL).is_err());
}

#[test]
fn a_cancel_before_the_write_leaves_everything_as_it_is() {
    for after in 0..6 {
        let sensor = at(5);
        let mut bench = bench(&[&sensor]);
        let before = store(&sensor);
        let operation = SetZero::new(device(5), Axis::Two);
        let run = run_and(&mut bench, operation, |runner, requests| {
            if requests == after {
                runner.cancel();
            }
        });
        let failure = run.result.unwrap_err();
        assert_eq!((failure.cause, failure.writes), (Cause::Cancelled, 0), "after {after}");
        assert_eq!(store(&sensor), before);
    }
}

#[test]
fn a_cancel_after_the_write_still_finds_out_what_it_did() {
    let sensor = at(5);
    let mut bench = bench(&[&sensor]);
    let operation = Set::new(device(5), DeviceSetting::Damping(9)).unwrap();
    let run = run_and(&mut bench, operation, |runner, requests| {
        if requests == 2 {
            runner.cancel();
        }
    });
    assert_eq!(run.result.unwrap().writes, 1);
    assert_eq!(store(&sensor).damping_ms, 9);
}
