//! The binding: what a gateway says through the map, and what becomes of writes.

mod common;

use clino_bus::{Duration, Instant};
use clino_codec::{isu, t7};
use clino_commissioning::isu::Module;
use clino_gateway::config::Kind;
use clino_gateway::order::Order;
use clino_gateway::{Bus, DegradedMode, Requester, SlotConfig, Source, task};
use clino_modbus::binding::{Binding, DeferredRequest};
use clino_modbus::command::{Command, Outcome};
use clino_modbus::settings::Settings;
use clino_modbus::{Host, Refusal, Write};
use clino_recovery::{Clock, Mode, Start, StartCause};
use common::board::Board;
use common::{Bench, SETTINGS};

fn command(command: Command, target: u16, value: i32) -> Write<'static> {
    Write::Command { command, target, value, armed: false }
}

/// A register.
fn read(binding: &impl Host, address: u16) -> u16 {
    let mut found = None;
    binding.read(&Settings::DEFAULT, address, 1, &mut |word| found = Some(word)).unwrap();
    found.unwrap()
}

/// What the command registers say.
struct Progress {
    command: u16,
    outcome: u16,
    sequence: u16,
}

impl Progress {
    fn of(binding: &impl Host) -> Progress {
        let [command, outcome, sequence] = [0x1F08, 0x1F09, 0x1F0A].map(|address| read(binding, address));
        Progress { command, outcome, sequence }
    }
}

/// A server in front of the board, and what a board has in front of it.
fn bench(board: &Board) -> Bench<Binding<&Board>> {
    Bench::at(Binding::new(board), SETTINGS, 573, 2_006)
}

/// A signed number of two registers.
fn wide(words: &[u16]) -> i32 {
    (u32::from(words[0]) << 16 | u32::from(words[1])).cast_signed()
}

#[test]
fn a_value_is_what_the_gateway_says() {
    let board = Board::new();
    let mut bench = bench(&board);
    // Half: 6.749 * 50 - 157.45 = 180.
    board.cycle(500_000);
    board.now.set(Instant::from_micros(1_020_000));
    let block = bench.read(0x0140, 32).unwrap();
    assert_eq!((block[0], block[1], block[8]), (1, 0, 20), "ok, no flag, 20 ms");
    assert!((wide(&block[2..4]) - 180_000).abs() <= 1, "{block:?}");
    assert_eq!(block[10..12], block[2..4], "the sensor says the same");
    assert_eq!(block[30..], [3, 1], "the first PWM input");
    // Slot 0 was never read, slot 9 is not in use.
    assert_eq!(bench.read(0x0100, 1), Ok(vec![0]));
    assert_eq!(bench.read(0x0220, 1), Ok(vec![13]));
    // Both buses have slots, and none has answered.
    // Unsaved, and slots without a value.
    let expected = 1 << 0 | 1 << 1 | 1 << 3 | 1 << 10;
    assert_eq!(bench.read(0x000A, 1), Ok(vec![expected]));
    assert_eq!(bench.read(0x0006, 2), Ok(vec![0x0102, 3]), "the version");
    // A publication later what was looked at does not hold any more.
    assert!(bench.host.held_still());
    board.cycle(400_000);
    assert!(!bench.host.held_still());
    // Three periods without a cycle.
    board.now.set(Instant::from_micros(1_020_000 + 100_001));
    let block = bench.read(0x0140, 9).unwrap();
    assert_eq!((block[0], &block[2..4]), (2, &[0x8000, 0][..]));
}

#[test]
fn what_is_not_written_stays_as_it_is() {
    let board = Board::new();
    let mut bench = bench(&board);
    let before = board.config(2);
    assert_eq!(before.period.as_micros(), 33_333, "finer than the map can tell");
    bench.write_one(0x1049, 4).unwrap();
    assert_eq!(board.config(2), SlotConfig { retries: 4, ..before });
    // The whole block, as it was read.
    let block = bench.read(0x1040, 25).unwrap();
    assert_eq!((block[5], block[7]), (33, 99));
    bench.write(0x1040, &block).unwrap();
    assert_eq!(board.config(2), SlotConfig { retries: 4, ..before });
    // Direction and filter of slot 0; a stale limit of its own.
    bench.write(0x100C, &[1, 0, 2, 5]).unwrap();
    bench.write(0x1006, &[0, 250]).unwrap();
    let config = board.config(0);
    assert_eq!((config.filter, config.samples), (clino_gateway::config::Filter::Median, 5));
    assert_eq!(config.direction, clino_gateway::config::Direction::Reversed);
    assert_eq!((config.stale, config.period), (Duration::from_millis(250), Duration::from_millis(20)));
}

/// Blocks of slots in every state, as they were read: nothing changes.
#[test]
fn every_block_can_be_written_back() {
    let board = Board::new();
    let mut bench = bench(&board);
    // Slot 3: a kind and no address; slot 4: an address and no kind; slot 5: settings and no kind.
    bench.write_one(0x1061, 2).unwrap();
    bench.write_one(0x1082, 9).unwrap();
    bench.write(0x10A4, &[0, 5_000]).unwrap();
    let configs: Vec<SlotConfig> = (0..48).map(|slot| board.config(slot)).collect();
    let fingerprint = board.gateway.borrow().fingerprint();
    for slot in 0..48 {
        let first = 0x1000 + 0x20 * slot;
        let block = bench.read(first, 25).unwrap();
        bench.write(first, &block).unwrap_or_else(|code| panic!("slot {slot}: exception {code}, {block:?}"));
        assert_eq!(board.config(slot.into()), configs[usize::from(slot)], "slot {slot}");
    }
    for (first, length) in [(0x1800, 6), (0x1810, 6), (0x1840, 8), (0x1850, 2)] {
        let block = bench.read(first, length).unwrap();
        bench.write(first, &block).unwrap();
        // The port is switched to what it was.
        bench.pause(50_000);
        assert_eq!(bench.read(first, length).unwrap(), block);
    }
    assert_eq!(board.gateway.borrow().fingerprint(), fingerprint);
}

/// Row 18 and 19: what the console gives, and what is named in the same request.
#[test]
fn another_kind_brings_what_is_usual_for_it() {
    let board = Board::new();
    let mut bench = bench(&board);
    for (kind, address) in [(Kind::T7, 9), (Kind::Isu, 14), (Kind::Pwm, 2)] {
        let first = 0x1000 + 0x20 * (40 + kind as u16);
        let usual = SlotConfig::usual(Source::of(kind, address, clino_codec::t7::Axis::Two));
        // Enabled, kind, address, and no axis.
        bench.write(first, &[1, kind as u16, address.into()]).unwrap();
        assert_eq!(board.config(40 + kind as usize), usual);
        // All that can be said, each as it is in an unused slot.
        let unused = bench.read(0x15E0, 17).unwrap();
        let mut block = unused.clone();
        block[..3].copy_from_slice(&[1, kind as u16, address.into()]);
        bench.write(0x15E0, &block).unwrap();
        assert_eq!(bench.read(0x15E0, 17).unwrap(), block, "what is acknowledged is there");
        let config = board.config(47);
        assert_eq!((config.period, config.retries, config.confirm), (Duration::ZERO, 0, false));
        bench.write(0x15E0, &unused).unwrap();
        assert_eq!(bench.read(0x15E0, 17).unwrap(), unused);
        bench.write(0x15E0, &[0, 0, 0]).unwrap();
        bench.write(0x15E0, &unused).unwrap();
    }
}

/// Row 20: one register at a time, in any order.
#[test]
fn one_register_at_a_time_in_any_order() {
    // Enabled, kind, address, axis, retries, samples.
    let orders: [[usize; 6]; 6] = [
        [0, 1, 2, 3, 4, 5],
        [5, 4, 3, 2, 1, 0],
        [1, 2, 0, 3, 5, 4],
        [2, 1, 5, 4, 3, 0],
        [3, 2, 4, 1, 0, 5],
        [4, 5, 2, 1, 3, 0],
    ];
    for (kind, address) in [(1, 9), (2, 14), (2, 0), (3, 2)] {
        for order in orders {
            let board = Board::new();
            let mut bench = bench(&board);
            let writes = [(0, 1), (1, kind), (2, address), (3, 1), (9, 7), (15, 3)];
            for at in order {
                let (offset, word) = writes[at];
                bench
                    .write_one(0x1200 + offset, word)
                    .unwrap_or_else(|code| panic!("{order:?} {offset}: {code}"));
                assert_eq!(bench.read(0x1200 + offset, 1), Ok(vec![word]), "{order:?}");
            }
            for (offset, word) in writes {
                assert_eq!(
                    bench.read(0x1200 + offset, 1),
                    Ok(vec![word]),
                    "{order:?}: kind {kind}, {offset}"
                );
            }
            let config = board.config(16);
            // An address of 0 in an unused slot is none: an ISU has to be told it, so that it is not asked by chance.
            let told = order.iter().position(|&at| at == 1) < order.iter().position(|&at| at == 2);
            assert_eq!(config.is_on(), address > 0 || told, "{order:?}: {config:?}");
            let usual = SlotConfig::usual(config.source);
            assert_eq!((config.period, config.max_rate), (usual.period, usual.max_rate), "{order:?}");
        }
    }
}

/// A kind without an address is not asked for, and says so.
#[test]
fn a_source_without_an_address_is_a_fault_of_the_configuration() {
    let board = Board::with(&[]);
    let mut bench = bench(&board);
    for kind in 1..=3 {
        let first = 0x1000 + 0x20 * kind;
        bench.write_one(first + 1, kind).unwrap();
        board.gateway.borrow_mut().publish();
        assert_eq!(bench.read(0x0100 + 0x20 * kind, 1), Ok(vec![14]), "kind {kind}");
        assert_eq!(bench.read(0x0100 + 0x20 * kind + 30, 2), Ok(vec![kind, 0]));
    }
    board.run();
    let gateway = board.gateway.borrow();
    assert_eq!(Bus::ALL.map(|bus| gateway.counters(bus).requests), [0, 0]);
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let board = Board::new();
    let mut bench = bench(&board);
    let before = board.config(0);
    for (offset, words) in [
        (2, &[101][..]),
        (2, &[0]),
        (1, &[1, 101]),
        (1, &[3, 3]),
        (1, &[2, 15]),
        (3, &[3]),
        (15, &[9]),
        // Stale: below its least; below the period; with the period of 20 ms as it is. A period beyond the limit that is set.
        (6, &[0, 9]),
        (6, &[0, 19]),
        (4, &[0, 1_000, 0, 60]),
        // A T7 has 2 ms to answer.
        (8, &[1]),
        // Stale follows, and is another one.
        (20, &[0, 100, 0xFFFF, 100, 2]),
    ] {
        assert_eq!(bench.write(0x1000 + offset, words), Err(3), "{offset} {words:?}");
        assert_eq!(board.config(0), before, "{offset} {words:?}");
    }
    assert_eq!(bench.write(0x1810, &[0, 19_200]), Err(3), "an ISU has one bit rate");
    // An ISU switches its driver on after 1 ms, a T7 answers within 2 ms.
    assert_eq!(bench.write_one(0x1814, 1_001), Err(3));
    assert_eq!(bench.write_one(0x1804, 2_001), Err(3));
}

/// Row 7: what was not set follows; what was set has to fit.
#[test]
fn a_stale_limit_goes_with_its_period() {
    let board = Board::new();
    let mut bench = bench(&board);
    let stale =
        |bench: &mut Bench<_>| (wide(&bench.read(0x1006, 2).unwrap()), bench.read(0x1018, 1).unwrap()[0]);
    assert_eq!(stale(&mut bench), (60, 1));
    bench.write(0x1004, &[0, 1_000]).unwrap();
    assert_eq!(stale(&mut bench), (3_000, 1));
    bench.write(0x1006, &[0, 1_500]).unwrap();
    assert_eq!(stale(&mut bench), (1_500, 0));
    assert_eq!(bench.write(0x1004, &[0, 1_600]), Err(3));
    bench.write(0x1004, &[0, 1_600, 0, 1_700]).unwrap();
    assert_eq!(stale(&mut bench), (1_700, 0));
    bench.write_one(0x1018, 1).unwrap();
    assert_eq!(stale(&mut bench), (4_800, 1));
    bench.write_one(0x1018, 0).unwrap();
    assert_eq!(stale(&mut bench), (4_800, 0));
    assert_eq!(bench.write(0x1004, &[0, 5_000]), Err(3));
}

/// Row 24: what is written as it is changes nothing.
#[test]
fn an_unchanged_value_is_no_change() {
    let board = Board::new();
    let mut bench = bench(&board);
    board.cycle(500_000);
    let fingerprint = || board.gateway.borrow().fingerprint();
    let before = fingerprint();
    bench.write_one(0x1049, 0).unwrap();
    bench.write(0x1800, &[1, 0xC200, 87]).unwrap();
    assert_eq!(fingerprint(), before);
    board.gateway.borrow_mut().publish();
    assert_eq!(bench.read(0x0140, 1), Ok(vec![1]), "the value is still there");
    bench.write_one(0x1049, 1).unwrap();
    assert_ne!(fingerprint(), before);
    // The same frame again would be taken for an echo.
    bench.pause(1_200_000);
    bench.write_one(0x1049, 0).unwrap();
    assert_eq!(fingerprint(), before, "and back");
}

/// Row 29: a guard that is named is kept, whatever it was before.
#[test]
fn a_bus_is_told_as_it_will_be() {
    let board = Board::new();
    let mut bench = bench(&board);
    bench.write(0x1800, &[0, 57_600, 87]).unwrap();
    assert_eq!(bench.read(0x1800, 3), Ok(vec![0, 57_600, 87]));
    bench.write(0x1800, &[1, 0xC200]).unwrap();
    assert_eq!(bench.read(0x1800, 3), Ok(vec![1, 0xC200, 87]));
    // A character is 174 us; one that was not named follows.
    bench.write(0x1800, &[0, 57_600]).unwrap();
    bench.write_one(0x1804, 12).unwrap();
    assert_eq!(bench.read(0x1800, 6), Ok(vec![0, 57_600, 174, 0, 12, 0]));
    assert_eq!(board.gateway.borrow().timing(Bus::T7).serial.baud, 115_200, "not yet");
    board.run();
    assert_eq!(board.gateway.borrow().timing(Bus::T7).serial.baud, 57_600);
    assert_eq!(bench.read(0x1800, 2), Ok(vec![0, 57_600]));
}

#[test]
fn port_and_console_have_all_their_settings() {
    let board = Board::new();
    let mut bench = bench(&board);
    assert_eq!(bench.read(0x1845, 3), Ok(vec![0, 0, 0]));
    bench.write(0x1845, &[2, 1]).unwrap();
    bench.pause(50_000);
    assert_eq!(bench.read(0x1845, 3), Ok(vec![2, 1, 0]));
    assert_eq!(bench.read(0x1850, 2), Ok(vec![0, 60]));
    bench.write(0x1850, &[0, 3_600]).unwrap();
    assert_eq!(board.gateway.borrow().console_settings().idle_ms(), Some(3_600_000));
    assert_eq!(bench.write(0x1850, &[1, 0x5181]), Err(3), "a day and a second");
}

#[test]
fn a_slot_has_a_name() {
    let board = Board::new();
    let mut bench = bench(&board);
    let name = |slot: usize| board.config(slot).name.as_str().to_owned();
    // "Boom left" in slot 1, zeros behind it.
    let words = [0x426F, 0x6F6D, 0x206C, 0x6566, 0x7400, 0, 0, 0];
    bench.write(0x1910, &words).unwrap();
    assert_eq!(name(1), "Boom left");
    assert_eq!(bench.read(0x1910, 8), Ok(words.to_vec()));
    bench.write(0x1914, &[0x7269, 0x6768]).unwrap();
    assert_eq!(name(1), "Boom lefrigh", "a part: the characters of these registers alone");
    // A control character, one that is no ASCII, a quotation mark, one behind the end.
    for wrong in [0x4107, 0x41E4, 0x4122, 0x0041] {
        assert_eq!(bench.write(0x1910, &[wrong, 0]), Err(3), "{wrong:04X}");
    }
    assert_eq!(bench.write(0x1918, &[0x4141, 0x4141]), Err(2), "there is no register behind its last one");
    assert_eq!(name(1), "Boom lefrigh");
    // Zeros in front end it.
    bench.write(0x1910, &[0; 8]).unwrap();
    assert_eq!(name(1), "");
}

#[test]
fn a_slot_is_zeroed_as_it_stands_or_not_at_all() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    board.cycle(500_000);
    binding.begin();
    assert_eq!(binding.write(&command(Command::SoftZero, 0, 0)), Err(Refusal::Failed), "never read");
    assert_eq!(binding.write(&command(Command::SoftZero, 48, 0)), Err(Refusal::Value));
    binding.write(&command(Command::SoftZero, 2, 0)).unwrap();
    assert!((board.config(2).soft_zero.mdeg() - 180_000).abs() <= 1);
    assert_eq!(Progress::of(&binding).outcome, Outcome::Done as u16);
    board.cycle(500_000);
    binding.begin();
    let angle = wide(&[read(&binding, 0x0142), read(&binding, 0x0143)]);
    assert!(angle <= 1 || angle >= 359_999, "{angle}");
    assert!((wide(&[read(&binding, 0x014A), read(&binding, 0x014B)]) - 180_000).abs() <= 1);
}

#[test]
fn a_task_runs_alone_and_tells_how_it_ends() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
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
        assert_eq!(binding.write(&command(wrong, target, value)), Err(Refusal::Value), "{wrong:?} {value}");
    }
    assert_eq!(read(&binding, 0x1F0A), 0);
    binding.write(&command(Command::SensorDamping, 0, 100)).unwrap();
    let progress = Progress::of(&binding);
    assert_eq!(
        (progress.command, progress.outcome),
        (Command::SensorDamping as u16, Outcome::Running as u16)
    );
    assert_eq!(binding.write(&command(Command::ClearCounters, 0, 0)), Err(Refusal::Busy));
    // No node answers.
    for _ in 0..10 {
        board.run();
        binding.poll();
    }
    let progress = Progress::of(&binding);
    assert_eq!((progress.outcome, progress.sequence), (Outcome::Failed as u16, 1));

    binding.write(&command(Command::SensorZero, 1, 0)).unwrap();
    binding.write(&command(Command::Cancel, Bus::Isu as u16, 0)).unwrap();
    for _ in 0..10 {
        board.run();
        binding.poll();
    }
    let progress = Progress::of(&binding);
    assert_eq!((progress.command, progress.outcome), (Command::Cancel as u16, Outcome::Cancelled as u16));
}

#[test]
fn a_cancel_is_a_command_and_tells_what_has_become_of_it() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    let last = |binding: &Binding<&Board>| {
        let Progress { command, outcome, sequence } = Progress::of(binding);
        (command, outcome, sequence)
    };
    binding.begin();
    assert_eq!(binding.write(&command(Command::Cancel, 2, 0)), Err(Refusal::Value), "no bus");
    // There is nothing to be stopped.
    binding.write(&command(Command::Cancel, Bus::T7 as u16, 0)).unwrap();
    assert_eq!(last(&binding), (Command::Cancel as u16, Outcome::Done as u16, 1));
    // What was begun here tells its end; it is running until then, and nothing else hides it.
    binding.write(&command(Command::SensorZero, 0, 0)).unwrap();
    assert_eq!(binding.write(&command(Command::Cancel, Bus::Isu as u16, 0)), Err(Refusal::Busy));
    binding.write(&command(Command::Cancel, Bus::T7 as u16, 0)).unwrap();
    binding.poll();
    assert_eq!(last(&binding), (Command::Cancel as u16, Outcome::Running as u16, 3));
    board.run();
    binding.poll();
    assert_eq!(last(&binding), (Command::Cancel as u16, Outcome::Cancelled as u16, 3));
    // What was begun at the console tells its end there; here it is known that it has ended.
    let module = Module::at(isu::Address::new(3).unwrap()).unwrap();
    let order = Order::Isu(task::isu::Task::Identify(module));
    board.gateway.borrow_mut().carry_out(order, Requester::Console).unwrap();
    binding.write(&command(Command::Cancel, Bus::Isu as u16, 0)).unwrap();
    binding.poll();
    assert_eq!(last(&binding), (Command::Cancel as u16, Outcome::Running as u16, 4));
    board.run();
    binding.poll();
    assert_eq!(last(&binding), (Command::Cancel as u16, Outcome::Done as u16, 4));
    assert!(board.gateway.borrow().has_task_event(Requester::Console));
}

#[test]
fn a_change_of_bit_rate_tells_how_many_nodes_it_leaves_behind() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
    for (slot, node) in [(5, 6), (6, 7), (7, 7)] {
        let address = t7::Address::new(node).unwrap();
        let config = SlotConfig::usual(Source::T7 { address, axis: t7::Axis::Two });
        board.gateway.borrow_mut().carry_out(Order::Slot { slot, config }, Requester::Console).unwrap();
    }
    binding.write(&command(Command::SensorBaud, 0, 57_600)).unwrap();
    assert_eq!(read(&binding, 0x1F0E), 2);
    for _ in 0..5 {
        board.run();
        binding.poll();
    }
    assert_eq!(read(&binding, 0x1F0E), 2, "until the next command");
    binding.write(&command(Command::SensorBaud, 0, 115_200)).unwrap();
    assert_eq!(read(&binding, 0x1F0E), 0, "that is no change");
}

/// Nothing is written half way: while a sensor is being set up, the gateway does not start again.
#[test]
fn a_reboot_waits_for_no_task_and_is_passed_on() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
    let task = t7::Address::new(5).map(clino_commissioning::t7::Device::at).unwrap().unwrap();
    board
        .gateway
        .borrow_mut()
        .carry_out(Order::T7(task::t7::Task::Identify(task)), Requester::Console)
        .unwrap();
    assert_eq!(binding.write(&command(Command::Reboot, 0, 0)), Err(Refusal::Busy));
    assert_eq!(*board.deferred.borrow(), []);
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
    binding.write(&command(Command::Reboot, 0, 0)).unwrap();
    assert_eq!(*board.deferred.borrow(), [DeferredRequest::Reboot]);
    // The answer before it has not come to its end: it says so.
    binding.done(false);
    assert_eq!((read(&binding, 0x1F09), read(&binding, 0x1F0D)), (3, 0));
}

#[test]
fn a_failed_command_says_why() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
    assert_eq!(read(&binding, 0x1F0D), 0);
    // No sensor is there.
    binding.write(&command(Command::SensorZero, 0, 0)).unwrap();
    for _ in 0..10 {
        board.run();
        binding.poll();
    }
    assert_eq!((read(&binding, 0x1F09), read(&binding, 0x1F0D)), (3, 3), "failed, no answer");
    binding.write(&command(Command::Save, 0, 0)).unwrap();
    assert_eq!((read(&binding, 0x1F09), read(&binding, 0x1F0D)), (1, 0), "running");
    binding.done(false);
    assert_eq!((read(&binding, 0x1F09), read(&binding, 0x1F0D)), (3, 26), "failed, not stored");
}

#[test]
fn how_it_has_started_is_told() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
    let told = 1 << 5 | 1 << 6 | 1 << 7;
    let quiet = Start { cause: StartCause::PowerOn, boots: 1, ..Start::default() };
    for (start, bits) in [
        (quiet, 0),
        (Start { cause: StartCause::BrownOut, ..quiet }, 0),
        (Start { cause: StartCause::Watchdog, ..quiet }, 0x80),
        (Start { cause: StartCause::Stalled, ..quiet }, 0x80),
        (Start { mode: Mode::Safe, ..quiet }, 0x20),
        (Start { mode: Mode::Bare, cause: StartCause::Panic, ..quiet }, 0xA0),
        (Start { clock: Clock::Internal, ..quiet }, 0x40),
        (Start { clock: Clock::Fallback, cause: StartCause::ClockFailed, ..quiet }, 0xC0),
    ] {
        board.start.set(start);
        assert_eq!(binding.status() & told, bits, "{start:?}");
    }
}

#[test]
fn what_is_restrained_fails_and_is_not_begun() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
    for degraded in [DegradedMode::InexactClock, DegradedMode::NoBuses] {
        board.gateway.borrow_mut().degrade(degraded);
        assert_eq!(
            binding.write(&command(Command::SensorDamping, 0, 5_001)),
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
            assert_eq!(binding.write(&command(order, target, value)), Err(Refusal::Failed), "{order:?}");
        }
        // What concerns the gateway alone goes on.
        let retries = Order::Slot { slot: 0, config: SlotConfig { retries: 4, ..board.config(0) } };
        board.gateway.borrow_mut().carry_out(retries, Requester::Modbus).unwrap();
        binding.write(&command(Command::ClearCounters, 0, 0)).unwrap();
    }
    board.gateway.borrow_mut().degrade(DegradedMode::None);
    binding.write(&command(Command::SensorDamping, 0, 100)).unwrap();
}

#[test]
fn counters_are_cleared_and_wishes_passed_on() {
    let board = Board::new();
    let mut binding = Binding::new(&board);
    binding.begin();
    board.run();
    assert!(board.gateway.borrow().counters(Bus::T7).requests > 10);
    binding.write(&command(Command::ClearCounters, 0, 0)).unwrap();
    assert_eq!(board.gateway.borrow().counters(Bus::T7).requests, 0);
    binding.write(&command(Command::Save, 0, 0)).unwrap();
    assert_eq!(Progress::of(&binding).outcome, Outcome::Running as u16);
    assert_eq!(binding.write(&command(Command::FactoryReset, 0, 0)), Err(Refusal::Busy));
    binding.done(true);
    assert_eq!(Progress::of(&binding).outcome, Outcome::Done as u16);
    assert_eq!(*board.deferred.borrow(), [DeferredRequest::Save]);
}
