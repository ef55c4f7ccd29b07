//! The low-speed oscillator, measured against the crystal, and what the watchdog's two times come to with it.
//!
//! TIM5 channel 4 captures the oscillator's edges (RM0090 section 18.4.21: TI4_RMP = 01). A reset by the watchdog would end the
//! test: its times are computed from the oscillator that runs it.

#![no_std]
#![no_main]

#[embedded_test::tests]
mod tests {
    use stm32f4xx_hal::pac;
    use stm32f4xx_hal::rcc::{Enable as _, Rcc};
    use target_tests::{PERIPHERAL_HZ, start, within_us};

    /// DS8626 table 42, Hz.
    const LSI_HZ: core::ops::RangeInclusive<u32> = 17_000..=47_000;
    /// Edges from the first capture to the last.
    const EDGES: u32 = 512;
    /// One edge at the slowest takes 59 us; the prescaler of the input takes every eighth.
    const LONGEST_CAPTURE_US: u32 = 1_000;

    struct State {
        timer: pac::TIM5,
        rcc: Rcc,
    }

    #[init]
    fn init() -> State {
        let device = pac::Peripherals::take().unwrap();
        let mut rcc = start(device.RCC, &mut cortex_m::Peripherals::take().unwrap());
        pac::TIM5::enable(&mut rcc);
        State { timer: device.TIM5, rcc }
    }

    /// Frequency of the oscillator in Hz.
    fn measure(State { timer, rcc }: &mut State) -> u32 {
        // SAFETY (this and the writes below): documented bits of the registers.
        rcc.csr().modify(|_, w| w.lsion().set_bit());
        assert!(within_us(LONGEST_CAPTURE_US, || rcc.csr().read().lsirdy().bit_is_set()));
        timer.or().write(|w| unsafe { w.bits(0b01 << 6) });
        timer.arr().write(|w| unsafe { w.bits(u32::MAX) });
        // CC4S = 01: TI4. IC4PSC = 11: every eighth edge.
        timer.ccmr2_input().write(|w| unsafe { w.bits(0b01 << 8 | 0b11 << 10) });
        timer.ccer().write(|w| w.cc4e().set_bit());
        timer.egr().write(|w| w.ug().set_bit());
        timer.cr1().write(|w| w.cen().set_bit());
        let capture = || {
            assert!(within_us(LONGEST_CAPTURE_US, || timer.sr().read().cc4if().bit_is_set()));
            timer.ccr4().read().bits()
        };
        capture();
        let first = capture();
        let last = (0..EDGES / 8).fold(first, |_, _| capture());
        (u64::from(PERIPHERAL_HZ) * u64::from(EDGES) / u64::from(last.wrapping_sub(first))) as u32
    }

    #[test]
    fn the_oscillator_is_within_its_data_sheet(mut state: State) {
        let hz = measure(&mut state);
        defmt::info!("LSI: {} Hz", hz);
        assert!(LSI_HZ.contains(&hz));
    }

    /// 4096 counts of a divider by 4 from reset, 1572 of one by 16 after the start (docs/registers.md).
    #[test]
    fn the_watchdog_s_times_are_those_promised(mut state: State) {
        let hz = measure(&mut state);
        let ms = |counts: u32, divider: u32| counts * divider * 1_000 / hz;
        let (reset, running) = (ms(4_096, 4), ms(1_572, 16));
        defmt::info!("watchdog: {} ms from reset, {} ms after the start", reset, running);
        assert!((340..=970).contains(&reset));
        // An erase takes up to 500 ms; docs/recovery.md promises 1.5 s.
        assert!((520..=1_500).contains(&running));
    }

    /// The registers of the watchdog take a write over within five cycles of its oscillator (RM0090 section 21.4.4).
    #[test]
    fn the_watchdog_takes_its_settings_over(state: State) {
        drop(state);
        // SAFETY: no other code uses the watchdog here. It is not started: START is not written.
        let watchdog = unsafe { &*pac::IWDG::ptr() };
        let key = |key: u16| watchdog.kr().write(|w| unsafe { w.bits(key) });
        key(0x5555);
        watchdog.pr().write(|w| unsafe { w.bits(2) });
        watchdog.rlr().write(|w| w.rl().set(1_571));
        let settled = within_us(10_000, || watchdog.sr().read().bits() & 0b11 == 0);
        defmt::info!("watchdog: settled {}", settled);
        // Without a started watchdog its oscillator may be off; then nothing settles, and the image is not affected.
        if settled {
            assert_eq!((watchdog.pr().read().bits(), watchdog.rlr().read().bits()), (2, 1_571));
        }
    }
}
