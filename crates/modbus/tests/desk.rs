//! The desk: what a gateway says through the map, and what becomes of writes.

mod common;

use clino_bus::Micros;
use clino_codec::{isu, t7};
use clino_commissioning::isu::Module;
use clino_gateway::order::Order;
use clino_gateway::{Asker, Bus as Line, BusChange, Restraint, SlotConfig, Snapshot, Source, Span, task};
use clino_modbus::command::{Command, Outcome};
use clino_modbus::config::{self, Filter};
use clino_modbus::desk::{Desk, Wish};
use clino_modbus::{Bus, Host, Kind, Refusal, Status, Write, slot_bits};
use clino_recovery::{Cause, Clock, Mode, Start};
use common::board::Board;

fn slot(desk: &impl Host, slot: u8, change: impl FnOnce(&mut config::SlotConfig)) -> Write {
    let mut config = desk.slot_config(slot.into());
    change(&mut config);
    Write::Slot { slot, config }
}

fn command(command: Command, target: u16, value: i32) -> Write {
    Write::Command { command, target, value, armed: false }
}

#[test]
fn a_value_is_what_the_gateway_says() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut publisher = snapshot.publisher();
    let mut desk = Desk::new(&board, &snapshot);
    // Half: 6.749 * 50 - 157.45 = 180.
    board.cycle(&mut publisher, 500_000);
    board.now.set(Micros(1_020_000));
    desk.snapshot();
    let reading = desk.reading(2);
    assert_eq!((reading.status, reading.age), (Status::Ok, Some(Micros(20_000))));
    assert!((reading.angle.unwrap() - 180_000).abs() <= 1, "{reading:?}");
    assert_eq!(desk.reading(0).status, Status::NeverRead);
    assert_eq!(desk.reading(9).status, Status::Disabled);
    assert!(desk.held_still());
    let detail = desk.detail(2);
    assert_eq!((detail.kind, detail.address), (Kind::Pwm, 1));
    assert_eq!(detail.raw, reading.angle);
    assert_eq!(detail.flags & slot_bits::REPEATED, 0);
    // Both buses have slots, and none has answered.
    let names: Vec<&str> = desk.summary().signals.names().collect();
    assert_eq!(names, ["t7_bus_dead", "isu_bus_dead", "unsaved", "slot_fault"]);
    let expected = 1 << 0 | 1 << 1 | 1 << 3 | 1 << 10;
    assert_eq!(desk.gateway().status, expected);
    assert_eq!(desk.gateway().version, (1, 2, 3));
    // Two publications later what was looked at does not hold any more.
    board.cycle(&mut publisher, 400_000);
    board.cycle(&mut publisher, 300_000);
    assert!(!desk.held_still());
    desk.snapshot();
    assert!(desk.held_still());
    // Three periods without a cycle.
    board.now.set(Micros(1_020_000 + 100_001));
    desk.snapshot();
    let reading = desk.reading(2);
    assert_eq!((reading.status, reading.angle), (Status::Stale, None));
}

#[test]
fn what_is_not_written_stays_as_it_is() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    let before = board.config(2);
    assert_eq!(before.period.as_micros(), 33_333, "finer than the map can tell");
    desk.write(&slot(&desk, 2, |config| config.retries = 4)).unwrap();
    assert_eq!(board.config(2), SlotConfig { retries: 4, ..before });
    desk.write(&slot(&desk, 0, |config| {
        config.zero_mdeg = -1_234;
        config.reversed = true;
        config.filter = Filter::Median;
        config.filter_length = 5;
        config.stale_ms = 250;
    }))
    .unwrap();
    let config = board.config(0);
    assert_eq!(config.soft_zero.mdeg(), -1_234);
    assert_eq!((config.filter, config.samples), (clino_gateway::config::Filter::Median, 5));
    assert_eq!(config.direction, clino_gateway::config::Direction::Reversed);
    assert_eq!(config.stale, Span::from_millis(250));
    assert_eq!(config.period, Span::from_millis(20));
}

#[test]
fn another_kind_brings_what_is_usual_for_it() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    desk.write(&slot(&desk, 40, |config| {
        config.kind = Kind::Isu;
        config.address = 14;
        config.retries = 3;
    }))
    .unwrap();
    let usual = SlotConfig::usual(Source::Isu { address: isu::Address::new(14).unwrap() });
    assert_eq!(board.config(40), SlotConfig { retries: 3, ..usual });
    desk.write(&slot(&desk, 40, |config| config.kind = Kind::None)).unwrap();
    assert_eq!(board.config(40), SlotConfig::OFF);
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    let before = board.config(0);
    let wrong: [fn(&mut config::SlotConfig); 5] = [
        |config| config.address = 101,
        |config| config.axis = 3,
        |config| config.filter_length = 9,
        |config| config.stale_ms = 9,
        |config| (config.kind, config.address) = (Kind::Pwm, 3),
    ];
    for (number, change) in wrong.into_iter().enumerate() {
        let mut write = slot(&desk, 0, change);
        if let Write::Slot { config, .. } = &mut write
            && number == 2
        {
            config.filter = Filter::Mean;
        }
        assert_eq!(desk.write(&write), Err(Refusal::Value), "{number}");
        assert_eq!(board.config(0), before, "{number}");
    }
    let change = BusChange { baud: Some(19_200), ..BusChange::NONE };
    assert_eq!(desk.write(&Write::Bus { bus: Bus::Isu, change }), Err(Refusal::Value));
}

#[test]
fn a_bus_is_told_as_it_will_be() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    let change = BusChange { baud: Some(57_600), post_delay: Some(Micros(12)), ..BusChange::NONE };
    desk.write(&Write::Bus { bus: Bus::T7, change }).unwrap();
    let shown = desk.bus_config(Bus::T7);
    assert_eq!((shown.baud, shown.post_delay_us), (57_600, 12));
    // A character is 174 us now.
    assert_eq!(shown.guard_us, 174);
    assert_eq!(board.gateway.borrow().timing(Line::T7).serial.baud, 115_200, "not yet");
    board.run();
    assert_eq!(board.gateway.borrow().timing(Line::T7).serial.baud, 57_600);
    assert_eq!(desk.bus_config(Bus::T7).baud, 57_600);
}

#[test]
fn a_slot_is_zeroed_as_it_stands_or_not_at_all() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut publisher = snapshot.publisher();
    let mut desk = Desk::new(&board, &snapshot);
    board.cycle(&mut publisher, 500_000);
    desk.snapshot();
    assert_eq!(desk.write(&command(Command::SoftZero, 0, 0)), Err(Refusal::Failed), "never read");
    assert_eq!(desk.write(&command(Command::SoftZero, 48, 0)), Err(Refusal::Value));
    desk.write(&command(Command::SoftZero, 2, 0)).unwrap();
    assert!((board.config(2).soft_zero.mdeg() - 180_000).abs() <= 1);
    assert_eq!(desk.gateway().progress.outcome, Outcome::Done);
    board.cycle(&mut publisher, 500_000);
    desk.snapshot();
    let angle = desk.reading(2).angle.unwrap();
    assert!(angle <= 1 || angle >= 359_999, "{angle}");
    assert!((desk.detail(2).raw.unwrap() - 180_000).abs() <= 1);
}

#[test]
fn a_task_runs_alone_and_tells_how_it_ends() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    desk.snapshot();
    for (wrong, target, value) in [
        (Command::SensorDamping, 2, 100), // a PWM input
        (Command::SensorDamping, 30, 100),
        (Command::SensorDamping, 0, 5_001),
        (Command::SensorDirection, 0, 2),
        (Command::SensorBaud, 0, 9_601),
        (Command::SensorRepair, 0, 0), // a T7
        (Command::SensorNull, 1, 65_536),
        (Command::SensorAddress, 0, 126),
    ] {
        assert_eq!(desk.write(&command(wrong, target, value)), Err(Refusal::Value), "{wrong:?} {value}");
    }
    assert_eq!(desk.gateway().progress.sequence, 0);
    desk.write(&command(Command::SensorDamping, 0, 100)).unwrap();
    let progress = desk.gateway().progress;
    assert_eq!((progress.command, progress.outcome), (Some(Command::SensorDamping), Outcome::Running));
    assert_eq!(desk.write(&command(Command::ClearCounters, 0, 0)), Err(Refusal::Busy));
    // Nobody answers.
    for _ in 0..10 {
        board.run();
        desk.poll();
    }
    let progress = desk.gateway().progress;
    assert_eq!((progress.outcome, progress.sequence), (Outcome::Failed, 1));

    desk.write(&command(Command::SensorZero, 1, 0)).unwrap();
    desk.write(&command(Command::Cancel, Bus::Isu as u16, 0)).unwrap();
    for _ in 0..10 {
        board.run();
        desk.poll();
    }
    let progress = desk.gateway().progress;
    assert_eq!((progress.command, progress.outcome), (Some(Command::Cancel), Outcome::Cancelled));
    assert_eq!(progress.sequence, 3);
}

#[test]
fn a_cancel_is_a_command_and_tells_what_has_become_of_it() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    let last = |desk: &Desk<'_, &Board>| {
        let progress = desk.gateway().progress;
        (progress.command, progress.outcome, progress.sequence)
    };
    desk.snapshot();
    assert_eq!(desk.write(&command(Command::Cancel, 2, 0)), Err(Refusal::Value), "no bus");
    // There is nothing to be stopped.
    desk.write(&command(Command::Cancel, Bus::T7 as u16, 0)).unwrap();
    assert_eq!(last(&desk), (Some(Command::Cancel), Outcome::Done, 1));
    // What was begun here tells its end; it is running until then, and nothing else hides it.
    desk.write(&command(Command::SensorZero, 0, 0)).unwrap();
    assert_eq!(desk.write(&command(Command::Cancel, Bus::Isu as u16, 0)), Err(Refusal::Busy));
    desk.write(&command(Command::Cancel, Bus::T7 as u16, 0)).unwrap();
    desk.poll();
    assert_eq!(last(&desk), (Some(Command::Cancel), Outcome::Running, 3));
    board.run();
    desk.poll();
    assert_eq!(last(&desk), (Some(Command::Cancel), Outcome::Cancelled, 3));
    // What was begun at the console tells its end there; here it is known that it has ended.
    let module = Module::at(isu::Address::new(3).unwrap()).unwrap();
    let order = Order::Isu(task::isu::Task::Identify(module));
    board.gateway.borrow_mut().carry_out(order, Asker::Console).unwrap();
    desk.write(&command(Command::Cancel, Bus::Isu as u16, 0)).unwrap();
    desk.poll();
    assert_eq!(last(&desk), (Some(Command::Cancel), Outcome::Running, 4));
    board.run();
    desk.poll();
    assert_eq!(last(&desk), (Some(Command::Cancel), Outcome::Done, 4));
    assert!(board.gateway.borrow().has_news(Asker::Console));
}

#[test]
fn a_change_of_bit_rate_tells_how_many_nodes_it_leaves_behind() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    desk.snapshot();
    for (slot, node) in [(5, 6), (6, 7), (7, 7)] {
        let address = t7::Address::new(node).unwrap();
        let config = SlotConfig::usual(Source::T7 { address, axis: t7::Axis::Two });
        board.gateway.borrow_mut().carry_out(Order::Slot { slot, config }, Asker::Console).unwrap();
    }
    desk.write(&command(Command::SensorBaud, 0, 57_600)).unwrap();
    assert_eq!(desk.gateway().progress.silenced, 2);
    for _ in 0..5 {
        board.run();
        desk.poll();
    }
    assert_eq!(desk.gateway().progress.silenced, 2, "until the next command");
    desk.write(&command(Command::SensorBaud, 0, 115_200)).unwrap();
    assert_eq!(desk.gateway().progress.silenced, 0, "that is no change");
}

#[test]
fn how_it_has_started_is_told() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    desk.snapshot();
    let told = 1 << 5 | 1 << 6 | 1 << 7;
    let quiet = Start { cause: Cause::PowerOn, boots: 1, ..Start::default() };
    for (start, bits) in [
        (quiet, 0),
        (Start { cause: Cause::BrownOut, ..quiet }, 0),
        (Start { cause: Cause::Watchdog, ..quiet }, 0x80),
        (Start { cause: Cause::Stalled, ..quiet }, 0x80),
        (Start { mode: Mode::Safe, ..quiet }, 0x20),
        (Start { mode: Mode::Bare, cause: Cause::Panic, ..quiet }, 0xA0),
        (Start { clock: Clock::Internal, ..quiet }, 0x40),
        (Start { clock: Clock::Fallback, cause: Cause::ClockFailed, ..quiet }, 0xC0),
    ] {
        board.start.set(start);
        assert_eq!(desk.gateway().status & told, bits, "{start:?}");
        assert_eq!(desk.start(), start);
    }
}

#[test]
fn what_is_restrained_fails_and_is_not_begun() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    desk.snapshot();
    for restraint in [Restraint::InexactClock, Restraint::NoBuses] {
        board.gateway.borrow_mut().restrain(restraint);
        assert_eq!(
            desk.write(&command(Command::SensorDamping, 0, 5_001)),
            Err(Refusal::Value),
            "wrong in itself"
        );
        for (order, target, value) in [
            (Command::SensorDamping, 0, 100),
            (Command::SensorZero, 0, 0),
            (Command::SensorBaud, 0, 9_600),
            (Command::SensorAddress, 1, 4),
            (Command::SensorRepair, 1, 0),
        ] {
            assert_eq!(desk.write(&command(order, target, value)), Err(Refusal::Failed), "{order:?}");
        }
        // What concerns the gateway alone goes on.
        desk.write(&slot(&desk, 0, |config| config.retries = 4)).unwrap();
        desk.write(&command(Command::ClearCounters, 0, 0)).unwrap();
    }
    board.gateway.borrow_mut().restrain(Restraint::None);
    desk.write(&command(Command::SensorDamping, 0, 100)).unwrap();
}

#[test]
fn counters_are_cleared_and_wishes_passed_on() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    desk.snapshot();
    board.run();
    assert!(desk.counters(Bus::T7).requests > 10);
    desk.write(&command(Command::ClearCounters, 0, 0)).unwrap();
    assert_eq!(desk.counters(Bus::T7).requests, 0);
    desk.write(&command(Command::Save, 0, 0)).unwrap();
    assert_eq!(desk.gateway().progress.outcome, Outcome::Running);
    assert_eq!(desk.write(&command(Command::FactoryReset, 0, 0)), Err(Refusal::Busy));
    desk.done(true);
    assert_eq!(desk.gateway().progress.outcome, Outcome::Done);
    assert_eq!(*board.wishes.borrow(), [Wish::Save]);
}

#[test]
fn a_save_that_replaces_what_was_not_read_wants_the_key() {
    let (board, snapshot) = (Board::new(), Snapshot::new());
    let mut desk = Desk::new(&board, &snapshot);
    board.unread.set(true);
    let save = |armed| Write::Command { command: Command::Save, target: 0, value: 0, armed };
    assert_eq!(desk.write(&save(false)), Err(Refusal::Value));
    assert_eq!((desk.gateway().progress.command, board.wishes.borrow().len()), (None, 0));
    assert_eq!(desk.write(&save(true)), Ok(()));
    assert_eq!(*board.wishes.borrow(), [Wish::Save]);
}
