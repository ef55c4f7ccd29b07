//! The firmware's PWM capture measures a PWM that the chip makes itself: **needs a wire from PB0 to PA1**.
//!
//! TIM3 channel 3 at PB0 makes it, TIM5 channel 2 at PA1 measures it. Both run from the same clock: the figures are exact but
//! for a tick, whatever the crystal does.

#![no_std]
#![no_main]

#[path = "../../src/capture.rs"]
#[allow(dead_code, reason = "one of its two inputs is used")]
mod capture;

mod clock {
    use clino_bus::Instant;
    use cortex_m::peripheral::DWT;

    /// Now, for less than 25 s.
    pub fn now() -> Instant {
        Instant::from_micros(u64::from(DWT::cycle_count() / (target_tests::CORE_HZ / 1_000_000)))
    }
}

mod params {
    use clino_bus::Duration;

    /// As in the image's parameters.
    pub const CAPTURE_FILTER: u8 = 0b1111;
    pub const PWM_NO_SIGNAL: Duration = Duration::from_micros(83_333);
}

#[embedded_test::tests]
mod tests {
    use core::ops::Deref;

    use clino_codec::pwm::{Law, Ticks};
    use clino_gateway::Capture;
    use heapless::spsc::Queue;
    use stm32f4xx_hal::gpio::{Alternate, PA1, Pull};
    use stm32f4xx_hal::pac::{self, tim2};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc::Enable as _;
    use target_tests::{start, within_us};

    use crate::capture::{PwmCapture, TimerInput};
    use crate::clock;

    /// Divider of the source: it counts microseconds of 84 timer ticks.
    const TICKS_PER_US: u32 = 84;
    /// An ISU's 30 Hz.
    const PERIOD_US: u16 = 33_333;
    /// 36.6 % of it: 89.56 degrees (AN #201).
    const HIGH_US: u16 = 12_200;
    /// The filter delays both edges alike, but for a sample.
    const TOLERANCE: u32 = 32;

    /// As in the image's `board.rs`: TIM5 has the registers of TIM2.
    struct Timer(pac::TIM5);

    impl Deref for Timer {
        type Target = tim2::RegisterBlock;

        fn deref(&self) -> &tim2::RegisterBlock {
            let _ = &self.0;
            // SAFETY: the peripheral is owned and lives for ever; every register used is at the same offset.
            unsafe { &*pac::TIM5::ptr().cast() }
        }
    }

    struct State {
        input: PwmCapture<Timer, PA1<Alternate<2>>>,
        captures: heapless::spsc::Consumer<'static, Capture>,
        source: pac::TIM3,
    }

    #[init]
    fn init() -> State {
        static mut QUEUE: Queue<Capture, 4> = Queue::new();
        let device = pac::Peripherals::take().unwrap();
        let mut rcc = start(device.RCC, &mut cortex_m::Peripherals::take().unwrap());
        let (a, b) = (device.GPIOA.split(&mut rcc), device.GPIOB.split(&mut rcc));
        b.pb0.into_alternate::<2>();
        let pin = a.pa1.into_alternate::<2>().internal_resistor(Pull::None);
        pac::TIM3::enable(&mut rcc);
        pac::TIM5::enable(&mut rcc);
        let source = device.TIM3;
        // SAFETY (this and the writes below): documented fields; PWM mode 1 on channel 3.
        source.psc().write(|w| unsafe { w.bits(TICKS_PER_US - 1) });
        source.arr().write(|w| unsafe { w.bits(u32::from(PERIOD_US - 1)) });
        source.ccr3().write(|w| unsafe { w.bits(u32::from(HIGH_US)) });
        source.ccmr2_output().write(|w| unsafe { w.bits(0b110 << 4) });
        source.ccer().write(|w| w.cc3e().set_bit());
        source.egr().write(|w| w.ug().set_bit());
        source.cr1().write(|w| w.cen().set_bit());
        // SAFETY: the harness calls this once in the life of the program.
        let queue = unsafe { &mut *(&raw mut QUEUE) };
        let (producer, captures) = queue.split();
        State { input: PwmCapture::new(Timer(device.TIM5), TimerInput::Ti2, pin, producer), captures, source }
    }

    /// The next capture, by looking at the flag that the interrupt would be for.
    fn next(State { input, captures, .. }: &mut State) -> Option<Capture> {
        // SAFETY: reading a status register that has no side effect.
        let timer = unsafe { &*pac::TIM5::ptr() };
        within_us(200_000, || {
            if timer.sr().read().cc2if().bit_is_set() {
                let _ = input.on_interrupt();
            }
            input.poll(clock::now());
            captures.ready()
        });
        captures.dequeue()
    }

    #[test]
    fn period_and_high_time_are_those_of_the_source(mut state: State) {
        for _ in 0..10 {
            let Some(Capture::Cycle(Ticks { period, high })) = next(&mut state) else {
                panic!("no cycle: is PB0 connected to PA1?")
            };
            defmt::info!("period {} ticks, high {} ticks", period, high);
            assert!(period.abs_diff(u32::from(PERIOD_US) * TICKS_PER_US) <= TOLERANCE);
            assert!(high.abs_diff(u32::from(HIGH_US) * TICKS_PER_US) <= TOLERANCE);
            let angle = Law::Documented.angle(Ticks { period, high }).unwrap().udeg();
            assert!(angle.abs_diff(89_566_000) < 5_000);
        }
    }

    #[test]
    fn a_source_that_stops_is_no_signal(mut state: State) {
        assert!(matches!(next(&mut state), Some(Capture::Cycle(_))));
        state.source.cr1().modify(|_, w| w.cen().clear_bit());
        let silent = (0..4).filter_map(|_| next(&mut state)).any(|it| matches!(it, Capture::NoSignal { .. }));
        assert!(silent);
    }
}
