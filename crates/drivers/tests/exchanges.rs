//! Deadlines, late answers, noise, babble: what the driver makes of a line as it is in life.
#![cfg(all(feature = "embedded-io", feature = "nb"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use clino_drivers::codec::t7::{Axis, DecodeError, Millidegrees, Request, Response};
use clino_drivers::rs485::PortSettings;
use clino_drivers::{Blame, Duration, Retry, Timing, UsDigitalT7, codec, t7};
use clino_segment::chance::{Chance, Probability};
use clino_segment::{Babble, Faults, Noise, Station};
use clino_sim::fault::AnswerFault as Fault;
use clino_sim::node::Ns;
use common::{Board, Model, sensors};
use support::{CHARACTER, MS, SERIAL, address, io_line, nb_line, nb_t7, turns};

/// A dead T7 at 115200 bit/s: 3 characters, 2 ms, one character, one of margin (the bus's own figure is 2.43 ms),
/// after the guard of one character.
const DEAD: Ns = 2_435_000 + CHARACTER;

fn is_true(board: &Board, angle: codec::angle::Angle) -> bool {
    sensors::is_true(angle, sensors::TURNING.at(board.now()))
}

#[test]
fn a_dead_node_costs_little() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let before = board.now();
    let error = t7.angle(address(6), Axis::Two).unwrap_err();
    let cost = board.now() - before;
    let waited =
        matches!(error, t7::Error::NoAnswer { waited, .. } if waited == Duration::from_micros(2_174));
    assert!(waited, "{error:?}");
    assert_eq!(error.blame(), Blame::Node);
    // Never shorter; longer by what the calls cost, two for every delay of 10 µs.
    assert!(cost >= DEAD, "{cost}");
    assert!(cost < DEAD + DEAD / 10, "{cost}");
    // And the next one is not any worse for it; without `many-nodes` the late answer is waited for, 25 ms.
    let before = board.now();
    let angle = t7.angle(address(5), Axis::Two).unwrap();
    assert!(is_true(&board, angle));
    let worse = if cfg!(feature = "many-nodes") { 0..MS } else { 20 * MS..28 * MS };
    assert!(worse.contains(&(board.now() - before).saturating_sub(3 * MS)), "{}", board.now() - before);
}

/// The answer to one request is never taken for that to the next, if it is no later than [`Timing::late`].
#[test]
fn late_answers_are_counted_and_thrown_away() {
    for delay in (0..25_000).step_by(171).map(|us| us * 1_000) {
        let sensor = sensors::t7(5);
        let board = sensors::t7_board(Model::BARE, &[&sensor]);
        let mut t7 = nb_t7(&board);
        sensor.lock().unwrap().faults.next = Some(Fault::Late(delay));
        let first = t7.angle(address(5), Axis::Two);
        if let Ok(angle) = first {
            assert!(is_true(&board, angle), "{delay}");
        }
        // What a late answer says is 2 °/s · 25 ms = 0.05° old at least: not to be taken for the truth.
        let before = board.now();
        let second = t7.angle(address(5), Axis::Two).unwrap_or_else(|error| panic!("{delay}: {error:?}"));
        assert!(is_true(&board, second), "{delay}");
        let said = *sensor.lock().unwrap().said().last().unwrap();
        assert!(said.at >= before, "{delay}: said before it was asked");
        assert_eq!(t7.counters().late, u32::from(first.is_err()), "{delay}");
    }
}

/// A late answer of one node does not spoil the exchange with another: with it in the middle, that is
/// refused or heard after all, and never wrong.
#[test]
fn late_answers_do_not_go_to_another_node() {
    let mut refused = 0;
    for delay in (0..10_000).step_by(67).map(|us| us * 1_000) {
        let (five, six) = (sensors::t7(5), sensors::t7_with(6, Default::default()));
        let board = sensors::t7_board(Model::BARE, &[&five, &six]);
        let mut t7 = nb_t7(&board);
        five.lock().unwrap().faults.next = Some(Fault::Late(delay));
        let _ = t7.angle(address(5), Axis::Two);
        while board.now() < 15 * MS {
            match t7.angle(address(6), Axis::Two) {
                Ok(angle) => assert!(sensors::is_true(angle, 0), "{delay}"),
                Err(_) => {
                    refused += 1;
                    // The other has heard half a command among the answer, and waits for its end.
                    board.pass(500 * MS);
                }
            }
        }
        let angle = t7.angle(address(6), Axis::Two).unwrap();
        assert!(sensors::is_true(angle, 0), "{delay}");
    }
    // Without `many-nodes` the second is not asked before the first one's answer can come no more.
    assert_eq!(
        refused > 0,
        cfg!(feature = "many-nodes"),
        "{refused}: whether the two have met at some delay"
    );
}

#[test]
fn a_line_that_is_known_to_have_rested_is_asked_at_once() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let dead = |t7: &mut UsDigitalT7<_>| {
        let before = board.now();
        t7.angle(address(6), Axis::Two).unwrap_err();
        board.now() - before
    };
    dead(&mut t7);
    assert!(dead(&mut t7) > 25 * MS, "its late answer could still come");
    board.pass(100 * MS);
    t7.pass(Duration::from_millis(100));
    assert!(dead(&mut t7) < 3 * MS);
}

fn noisy_board(bit_errors: f64, model: Model) -> (Board, sensors::SharedT7) {
    let sensor = sensors::t7(5);
    let noise = Noise { bit_errors: Probability::new(bit_errors).unwrap(), ..Default::default() };
    let settings = clino_segment::SegmentSettings { chance: Chance::new(7), noise, ..sensors::quiet() };
    let stations = vec![sensors::station("t7", sensor.clone())];
    (Board::new(115_200, model, settings, stations), sensor)
}

/// With one bit in two hundred wrong, about half of the exchanges fail; no angle is wrong.
#[test]
fn noise_makes_errors_not_angles() {
    for nb in [true, false] {
        let (board, _) = noisy_board(0.005, Model::BARE);
        let settings = PortSettings::new(SERIAL);
        let mut nb_t7 = UsDigitalT7::new(nb_line(&board, settings), Timing::t7(SERIAL));
        let mut io_t7 = UsDigitalT7::new(io_line(&board, settings), Timing::t7(SERIAL));
        let (mut good, mut bad) = (0, 0);
        for _ in 0..400 {
            let asked =
                if nb { nb_t7.angle(address(5), Axis::Two) } else { io_t7.angle(address(5), Axis::Two) };
            match asked {
                Ok(angle) => {
                    good += 1;
                    assert!(is_true(&board, angle), "{angle}");
                }
                Err(t7::Error::Bad { .. } | t7::Error::Garbled { .. } | t7::Error::NoAnswer { .. }) => {
                    bad += 1
                }
                Err(error) => panic!("{error:?}"),
            }
        }
        assert!(good > 80 && bad > 80, "{good} {bad}");
        assert!(turns(&board).all_clean());
    }
}

/// A receiver error within an answer spoils it, and is named.
#[test]
fn a_receiver_error_is_named() {
    let (board, _) = noisy_board(0.01, Model::BARE);
    let mut t7 = nb_t7(&board);
    let named = (0..400).any(|_| {
        matches!(t7.angle(address(5), Axis::Two), Err(t7::Error::Bad { error: DecodeError::LineErrors { errors }, .. })
            if errors.contains(codec::character::LineErrors::FRAMING))
    });
    assert!(named);
    assert!(t7.counters().framing > 0);
}

#[test]
fn tries_again_when_told_to() {
    let (board, _) = noisy_board(0.002, Model::BARE);
    let mut t7 = nb_t7(&board);
    t7.set_retry(Retry::times(2));
    for _ in 0..200 {
        match t7.angle(address(5), Axis::Two) {
            Ok(angle) => assert!(is_true(&board, angle), "{angle}"),
            // It heard half a command, and waits for its end.
            Err(_) => board.pass(500 * MS),
        }
    }
    let counters = t7.counters();
    assert!(counters.good > 150 && counters.retries > 10, "{counters:?}");
    assert_eq!(counters.requests, 200 + counters.retries);
}

/// What a node says out of turn before an answer costs nothing.
#[test]
fn stray_characters_before_an_answer_are_skipped() {
    let sensor = sensors::t7_with(5, Default::default());
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let stray = [0x00, 0xFF, 0x05, 0x06, 0x05, 0x06, 0x83, 0x00, 0x00, 0x00, 0x00, 0x72];
    sensor.lock().unwrap().faults.next = Some(Fault::Instead(stray.to_vec()));
    assert_eq!(t7.angle(address(5), Axis::Two).unwrap(), codec::angle::Angle::ZERO);
}

/// A node that never stops transmitting costs a bounded time, and the driver stays off.
#[test]
fn babble_is_not_talked_into() {
    for model in [Model::BARE, Model::BUFFERED] {
        let sensor = sensors::t7(5);
        let babble = Babble { from: 0, until: 300 * MS, gap: 0 };
        let faults = Faults { babble: vec![babble], ..Default::default() };
        let node = Box::new(sensors::t7(6));
        let babbler = Station { name: "babbler".to_owned(), node, faults };
        let stations = vec![sensors::station("t7", sensor), babbler];
        let board = Board::new(115_200, model, sensors::quiet(), stations);
        let mut t7 = nb_t7(&board);
        board.pass(3 * MS);
        let before = board.now();
        assert_eq!(t7.angle(address(5), Axis::Two), Err(t7::Error::LineBusy));
        // 68 characters, as the bus has it, besides what polling costs.
        assert!(board.now() - before < 8 * MS, "{}", board.now() - before);
        assert_eq!(turns(&board).count, 0);
        // A sensor may have taken the babble for the beginning of a command, and waits for its end.
        board.pass(300 * MS + 500 * MS);
        assert!(is_true(&board, t7.angle(address(5), Axis::Two).unwrap()));
    }
}

/// A node that starts to transmit when an answer is due costs a bounded time, too.
#[test]
fn babble_instead_of_an_answer_ends() {
    let babble = Babble { from: MS, until: 300 * MS, gap: 0 };
    let faults = Faults { babble: vec![babble], ..Default::default() };
    let node = Box::new(sensors::t7(5));
    let babbler = Station { name: "babbler".to_owned(), node, faults };
    let board = Board::new(115_200, Model::BARE, sensors::quiet(), vec![babbler]);
    let mut t7 = nb_t7(&board);
    let error = t7.angle(address(5), Axis::Two).unwrap_err();
    assert!(matches!(error, t7::Error::Garbled { .. } | t7::Error::Bad { .. }), "{error:?}");
    assert!(board.now() < 12 * MS, "{}", board.now());
}

#[test]
fn what_cannot_be_sent_is_not() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let all = codec::t7::Address::ALL;
    assert_eq!(t7.angle(all, Axis::Two), Err(t7::Error::NotSingleDevice));
    let error = t7.set_damping_ms(address(5), 1).unwrap_err();
    let limits =
        codec::t7::EncodeError::OutOfRange { field: codec::t7::Field::Damping, value: 1, min: 2, max: 5_000 };
    assert_eq!(error, t7::Error::Request(limits));
    assert_eq!(error.to_string(), "not sent: Damping 1 is not in 2..=5000");
    assert_eq!(error.blame(), Blame::Request);
    assert_eq!((turns(&board).count, board.now() < MS), (0, true));
    // On a line with one sensor, its address need not be known.
    let mut t7 = UsDigitalT7::single(t7.release(), Timing::t7(SERIAL));
    assert!(is_true(&board, t7.angle(all, Axis::Two).unwrap()));
    assert!(matches!(t7.all_data(all), Err(t7::Error::Request(_))), "its answer is too long");
}

#[test]
fn anything_can_be_asked() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    let set = Request::SetAngle { axis: Axis::Two, angle: Millidegrees(1_000) };
    let response = t7.transact(address(5), &set).unwrap();
    assert_eq!(response, Response::SetAngle(codec::t7::Status::Success));
    let angle = t7.angle(address(5), Axis::Two).unwrap();
    assert!((angle.mdeg() - 1_000).abs() < 100, "{angle}");
}

/// One live node among 32 keeps its rate.
#[test]
fn dead_nodes_do_not_starve_a_live_one() {
    let sensor = sensors::t7(32);
    let board = sensors::t7_board(Model::BARE, &[&sensor]);
    let mut t7 = nb_t7(&board);
    for number in 1..=31 {
        assert!(matches!(t7.angle(address(number), Axis::Two), Err(t7::Error::NoAnswer { .. })));
        assert!(is_true(&board, t7.angle(address(32), Axis::Two).unwrap()));
    }
    assert_eq!((t7.counters().good, t7.counters().no_answer), (31, 31));
}
