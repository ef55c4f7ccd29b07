//! The rules against the stock watchdog, whose time goes on with each test's `pass`.

use rsemu::core::device::Device;
use rsemu::dev::stm32::iwdg::Iwdg;

use super::*;

/// Stock watchdog and front. Its lazy surface is played by hand: one tick is one cycle of the oscillator.
struct Bench {
    device: Wrapped<Watchdog>,
    now: u64,
}

impl Bench {
    fn new() -> Bench {
        Bench { device: ruled(Arc::new(Iwdg::with_window(false))).expect("it has registers"), now: 0 }
    }

    fn write(&self, offset: u64, value: u16) {
        self.device.front().write(offset, &value.to_le_bytes(), MemAttrs::DEFAULT).expect("a register");
    }

    fn read(&self, offset: u64) -> u16 {
        let mut half = [0; 2];
        self.device.front().read(offset, &mut half, MemAttrs::DEFAULT).expect("a register");
        u16::from_le_bytes(half)
    }

    fn pass(&mut self, cycles: u64) {
        self.now += cycles;
        self.device.advance_to(self.now);
    }

    /// Cycles until it bites, with nothing else to come.
    fn bites_in(&mut self) -> u64 {
        self.pass(5);
        self.device.next_event_tick().expect("it runs") - self.now + 5
    }
}

/// Divider 16, 1000 counts.
fn set_up(bench: &Bench) {
    bench.write(offset::KR, 0x5555);
    bench.write(offset::PR, 2);
    bench.write(offset::RLR, 999);
}

#[test]
fn a_reload_counts_only_after_a_feed_once_it_has_been_taken_over() {
    // (Cycles from the settings to a feed, cycles from there to the reset): none; too early; in time.
    for (feed_after, expected) in [(None, 16 * 4_096), (Some(2), 16 * 4_096), (Some(6), 16 * 1_000)] {
        let mut bench = Bench::new();
        bench.write(offset::KR, 0xcccc);
        set_up(&bench);
        if let Some(cycles) = feed_after {
            bench.pass(cycles);
            bench.write(offset::KR, 0xaaaa);
        }
        let bites = bench.bites_in();
        assert!(bites.abs_diff(expected) <= 16, "{feed_after:?}: {bites}, expected {expected}");
    }
}

#[test]
fn a_watchdog_that_is_started_counts_from_its_longest_time() {
    let mut bench = Bench::new();
    set_up(&bench);
    bench.pass(6);
    bench.write(offset::KR, 0xcccc);
    assert!(bench.bites_in().abs_diff(16 * 4_096) <= 16);
    assert_eq!(bench.read(offset::RLR), 999);
    // Started again it goes on as it is.
    bench.pass(1_000);
    bench.write(offset::KR, 0xcccc);
    assert!(bench.bites_in().abs_diff(16 * 4_096 - 1_005) <= 16);
}

#[test]
fn a_write_while_the_last_one_is_being_taken_over_is_ignored() {
    let mut bench = Bench::new();
    bench.write(offset::KR, 0xcccc);
    set_up(&bench);
    assert_eq!(bench.read(offset::SR), 3);
    bench.write(offset::PR, 6);
    bench.write(offset::RLR, 50);
    assert_eq!((bench.read(offset::PR), bench.read(offset::RLR)), (2, 999));
    bench.pass(6);
    assert_eq!(bench.read(offset::SR), 0);
    bench.write(offset::RLR, 50);
    assert_eq!(bench.read(offset::RLR), 50);
}

#[test]
fn locked_registers_do_not_change_and_a_reset_forgets_all() {
    use rsemu::core::device::ResetKind;
    let mut bench = Bench::new();
    bench.write(offset::RLR, 5);
    assert_eq!((bench.read(offset::RLR), bench.read(offset::PR)), (0xfff, 0));
    bench.write(offset::KR, 0xcccc);
    set_up(&bench);
    bench.pass(6);
    bench.device.reset(ResetKind::Warm);
    assert_eq!((bench.read(offset::RLR), bench.read(offset::PR), bench.read(offset::SR)), (0xfff, 0, 0));
    assert_eq!(bench.device.next_event_tick(), None);
}
