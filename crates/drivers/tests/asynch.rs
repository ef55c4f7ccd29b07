//! The async drivers: the same answers, and futures that may be dropped at any time.
#![cfg(all(feature = "async", feature = "nb"))]

#[path = "../examples/common/mod.rs"]
mod common;
mod support;

use clino_drivers::codec::angle::Angle;
use clino_drivers::codec::t7::Axis;
use clino_drivers::rs485::{Echo, Error, PortSettings, Release};
use clino_drivers::t7::FlashWrite;
use clino_drivers::{AsyncPort, Retry, Serial, Timing, asynch, codec, isu, t7};
use clino_sim::fault::AnswerFault as Fault;
use common::executor::{block_on, block_on_until};
use common::uart::Flush;
use common::{Board, Model, sensors};
use support::{CHARACTER, IoLine, MS, SERIAL, US, address, io_line, turns};

fn t7_of(board: &Board) -> asynch::UsDigitalT7<IoLine> {
    asynch::UsDigitalT7::new(io_line(board, PortSettings::new(SERIAL)), Timing::t7(SERIAL))
}

fn angle(
    board: &Board,
    t7: &mut asynch::UsDigitalT7<IoLine>,
) -> Result<Angle, t7::Error<Error<LineError, Never>>> {
    block_on(board, t7.angle(address(5), Axis::Two))
}

type LineError = common::uart::LineError;
type Never = std::convert::Infallible;

fn is_true(board: &Board, angle: Angle) -> bool {
    sensors::is_true(angle, sensors::TURNING.at(board.now()))
}

#[test]
fn de_is_right() {
    for model in [Model::BARE, Model::BUFFERED] {
        let sensor = sensors::t7_with(5, sensors::quick(170 * US));
        let board = sensors::t7_board(model, &[&sensor]);
        let mut t7 = t7_of(&board);
        for _ in 0..20 {
            assert!(is_true(&board, angle(&board, &mut t7).unwrap()));
        }
        let turns = turns(&board);
        assert_eq!((turns.count, turns.sent.len()), (20, 60));
        assert!(turns.all_clean(), "{turns:?}");
        assert!(turns.hold.1 <= US, "{:?}", turns.hold);
    }
}

#[test]
fn a_flush_that_lies_is_held() {
    let sensor = sensors::t7(5);
    let model = Model { flush: Flush::Never, ..Model::BUFFERED };
    let board = sensors::t7_board(model, &[&sensor]);
    let settings = PortSettings { release: Release::WHOLE_FRAME, ..PortSettings::new(SERIAL) };
    let mut t7 = asynch::UsDigitalT7::new(io_line(&board, settings), Timing::t7(SERIAL));
    for _ in 0..10 {
        angle(&board, &mut t7).unwrap();
    }
    let turns = turns(&board);
    assert!(turns.all_clean() && turns.hold.1 <= 15 * US, "{turns:?}");
}

#[test]
fn a_dead_node_costs_little() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let mut t7 = t7_of(&board);
    let error = block_on(&board, t7.angle(address(6), Axis::Two)).unwrap_err();
    assert!(matches!(error, t7::Error::NoAnswer { .. }), "{error:?}");
    // 2.43 ms and the guard, with timers that are exact but for their calls.
    let dead = 2_435 * US + CHARACTER;
    assert!((dead..dead + 20 * US).contains(&board.now()), "{}", board.now());
    assert!(is_true(&board, angle(&board, &mut t7).unwrap()));
}

#[test]
fn late_answers_are_counted_and_thrown_away() {
    // Those that end within the time in which late answers are expected, 25 ms after the deadline.
    for delay in (0..24_000).step_by(171).map(|us| us * 1_000) {
        let sensor = sensors::t7(5);
        let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
        let mut t7 = t7_of(&board);
        sensor.lock().unwrap().faults.next = Some(Fault::Late(delay));
        let first = angle(&board, &mut t7);
        let before = board.now();
        assert!(is_true(&board, angle(&board, &mut t7).unwrap()), "{delay}");
        let said = *sensor.lock().unwrap().said().last().unwrap();
        assert!(said.at >= before, "{delay}: said before it was asked");
        assert_eq!(t7.counters().late, u32::from(first.is_err()), "{delay}");
    }
}

/// Dropped at any time, DE is low at once, and the next request gets its own answer.
#[test]
fn a_future_may_be_dropped_at_any_time() {
    let mut cut = 0;
    for until in (0..5_500).step_by(37).map(|us| us * US) {
        for model in [Model::BARE, Model::BUFFERED] {
            let sensor = sensors::t7(5);
            let board = sensors::t7_board(model, &[&sensor]);
            let mut t7 = t7_of(&board);
            let first = block_on_until(&board, until, t7.angle(address(5), Axis::Two));
            assert!(!turns(&board).high, "{until}");
            let dropped_at = board.now();
            let second = angle(&board, &mut t7).unwrap_or_else(|error| panic!("{until}: {error:?}"));
            assert!(is_true(&board, second), "{until}");
            let said = *sensor.lock().unwrap().said().last().unwrap();
            assert!(said.at >= dropped_at, "{until}: said before it was asked");
            // A sensor that heard half a frame is given the time to forget it.
            let turns = turns(&board);
            assert!(turns.all_clean() || board.now() - dropped_at > 500 * MS, "{until}: {turns:?}");
            cut += usize::from(first.is_none() && !turns.all_clean());
        }
    }
    assert!(cut > 5, "some were dropped in the middle of a frame: {cut}");
}

/// What a buffered UART still holds of a dropped frame goes nowhere, and not in front of the next frame.
#[test]
fn the_rest_of_a_dropped_frame_is_waited_for() {
    let board = sensors::t7_board(Model::BUFFERED, &[]);
    let mut line = io_line(&board, PortSettings::new(SERIAL));
    assert!(block_on_until(&board, 2 * CHARACTER, line.send(b"0123456789")).is_none());
    assert!(!turns(&board).high);
    block_on(&board, line.send(b"abc")).unwrap();
    let turns = turns(&board);
    assert_eq!(turns.bytes(), b"0123456789abc");
    let on_the_line: Vec<u8> = turns
        .sent
        .iter()
        .filter(|(_, fate)| *fate == clino_segment::log::Fate::Clean)
        .map(|&(byte, _)| byte)
        .collect();
    assert_eq!(on_the_line, b"0abc");
}

#[test]
fn a_stuck_uart_lets_go_of_the_line() {
    let board = sensors::t7_board(Model::BUFFERED, &[]);
    let mut line = io_line(&board, PortSettings::new(SERIAL));
    board.uart().jam(true);
    let error = block_on(&board, line.send(b"abc")).unwrap_err();
    assert!(matches!(error, Error::Stuck { .. }), "{error:?}");
    assert!(!turns(&board).high && board.now() < 25 * MS);
}

#[test]
fn an_echo_is_removed() {
    for echo in [true, false] {
        let latency = if echo { 170 * US } else { 2 * MS };
        let sensor = sensors::t7_with(5, sensors::quick(latency));
        let settings = clino_segment::SegmentSettings { echo, ..sensors::quiet() };
        let stations = vec![sensors::station("t7", sensor)];
        let board = Board::new(115_200, Model::BUFFERED, settings, stations);
        let settings = PortSettings { echo: Echo::Expected, ..PortSettings::new(SERIAL) };
        let mut t7 = asynch::UsDigitalT7::new(io_line(&board, settings), Timing::t7(SERIAL));
        match angle(&board, &mut t7) {
            Ok(angle) => assert!(echo && is_true(&board, angle)),
            Err(error) => {
                assert!(!echo);
                assert_eq!(error, t7::Error::Port(Error::Echo { index: 0, sent: 0x05, heard: None }));
            }
        }
    }
}

#[test]
fn noise_makes_errors_not_angles() {
    let sensor = sensors::t7(5);
    let bit_errors = clino_segment::Probability::new(0.002).unwrap();
    let noise = clino_segment::Noise { bit_errors, ..Default::default() };
    let settings = clino_segment::SegmentSettings { noise, ..sensors::quiet() };
    let board = Board::new(115_200, Model::BUFFERED, settings, vec![sensors::station("t7", sensor)]);
    let mut t7 = t7_of(&board);
    t7.set_retry(Retry::times(2));
    for _ in 0..200 {
        match angle(&board, &mut t7) {
            Ok(angle) => assert!(is_true(&board, angle), "{angle}"),
            // It heard half a command, and waits for its end.
            Err(_) => board.pass(500 * MS),
        }
    }
    let counters = t7.counters();
    assert!(counters.good > 150 && counters.retries > 10, "{counters:?}");
}

#[test]
fn settings_are_written_once() {
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let mut t7 = t7_of(&board);
    for expected in [FlashWrite::Written, FlashWrite::Unneeded] {
        assert_eq!(block_on(&board, t7.set_damping_ms(address(5), 250)), Ok(expected));
    }
    assert_eq!(block_on(&board, t7.damping_ms(address(5))), Ok(250));
    assert_eq!(t7.counters().writes, 1);
}

#[test]
fn an_isu_is_nulled() {
    let sensor = sensors::isu(3, 90_000_000);
    let board = sensors::isu_board(Model::BUFFERED, &[&sensor]);
    let line = io_line(&board, PortSettings::new(Serial::ISU));
    let mut isu = asynch::SttIsu::new(line, Timing::isu());
    let module = codec::isu::Address::new(3).unwrap();
    block_on(&board, isu.reset_null(module)).unwrap();
    board.pass(600 * MS);
    assert_eq!(block_on(&board, isu.angle(module)), Ok(Angle::ZERO));
    let all = codec::isu::Address::ANY;
    assert_eq!(block_on(&board, isu.angle(all)), Err(isu::Error::NotSingleDevice));
}

/// Anything half-duplex, through `embedded_io_async`.
#[test]
fn a_write_is_a_turn() {
    use embedded_io_async::{Read, Write};
    let sensor = sensors::t7(5);
    let board = sensors::t7_board(Model::BUFFERED, &[&sensor]);
    let mut line = io_line(&board, PortSettings::new(SERIAL));
    let mut answer = [0; 8];
    block_on(&board, async {
        Write::write_all(&mut line, &[0x05, 0x01, 0x83]).await.unwrap();
        Read::read_exact(&mut line, &mut answer).await.unwrap();
    });
    assert_eq!(answer[..3], [0x05, 0x06, 0x83]);
    assert_eq!(turns(&board).count, 1);
}
