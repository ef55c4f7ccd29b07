//! Pulse width: both laws, rounding, and every fault.

use clino_codec::angle::Angle;
use clino_codec::pwm::{Law, Limits, PwmFault, Ticks, measure};

/// Rate of the firmware's timers.
const TIMER_HZ: u32 = 84_000_000;
/// One nominal period at that rate.
const PERIOD: u32 = TIMER_HZ / 30;

fn ticks(high: u32) -> Ticks {
    Ticks { period: PERIOD, high }
}

fn documented(ticks: Ticks) -> Result<i32, PwmFault> {
    measure(ticks, &Limits::new(TIMER_HZ), Law::Documented).map(|reading| reading.angle.udeg())
}

/// `factor · high/period − offset` in exact rational arithmetic, rounded half away from zero.
fn expected_value(ticks: Ticks, factor: i128, offset: i128) -> i128 {
    let (period, high) = (i128::from(ticks.period), i128::from(ticks.high));
    let twice = 2 * (factor * high - offset * period);
    let rounded = (twice.abs() + period) / (2 * period);
    if twice < 0 { -rounded } else { rounded }
}

#[test]
fn both_laws_are_their_lines_rounded_half_away_from_zero() {
    let periods = [1, 2, 3, 7, 1_000, 7_680, PERIOD, PERIOD + 1, u32::MAX - 1, u32::MAX];
    for period in periods {
        for high in [0, 1, period / 7, period / 4, period / 3, period / 2, period - period / 4, period] {
            let ticks = Ticks { period, high };
            let documented = Law::Documented.angle(ticks).unwrap().udeg();
            assert_eq!(i128::from(documented), expected_value(ticks, 674_900_000, 157_450_000), "{ticks:?}");
            let idealised = Law::Idealised.angle(ticks).unwrap().udeg();
            assert_eq!(i128::from(idealised), expected_value(ticks, 675_000_000, 157_500_000), "{ticks:?}");
            assert_eq!(i128::from(ticks.duty_ppm().unwrap()), expected_value(ticks, 1_000_000, 0));
        }
    }
    assert_eq!(Law::default(), Law::Documented);
}

#[test]
fn exact_halves_are_rounded_away_from_zero() {
    // 674 900 000 · high / 2^25 is a half for high = 2^25 / (2 · 32) · odd: 674 900 000 = 2^5 · odd.
    let period = 1 << 25;
    let at = |high| Law::Documented.angle(Ticks { period, high }).unwrap().udeg();
    let half = |high: u32| (674_900_000_i64 * i64::from(high)) * 2 % (1 << 25) == 0;
    let odd_half =
        (1..period).find(|&high| half(high) && !(674_900_000 * u64::from(high)).is_multiple_of(1 << 25));
    let high = odd_half.unwrap();
    let exact = 674_900_000.0 * f64::from(high) / f64::from(period) - 157_450_000.0;
    assert_eq!(exact.fract(), -0.5);
    assert_eq!(f64::from(at(high)), exact - 0.5);
}

#[test]
fn the_idealised_law_is_the_counter_behind_the_output() {
    // 7680 steps of 4.34 µs make 1/30 s; 1792 of them at null, 4096 to a turn.
    for step in 0..4_096_u32 {
        let angle = Law::Idealised.angle(Ticks { period: 7_680, high: 1_792 + step }).unwrap();
        let error = i64::from(angle.udeg()) * 4_096 - i64::from(step) * 360_000_000;
        assert!(error.abs() <= 2_048, "{step}");
        let printed = Law::Documented.angle(Ticks { period: 7_680, high: 1_792 + step }).unwrap();
        assert!((printed.udeg() - angle.udeg()).abs() <= 27_000);
    }
}

#[test]
fn an_impossible_cycle_has_no_duty() {
    for ticks in [Ticks { period: 0, high: 0 }, Ticks { period: 9, high: 10 }] {
        assert_eq!(ticks.duty_ppm(), None);
        assert_eq!(Law::Documented.angle(ticks), None);
    }
}

#[test]
fn the_period_may_be_five_percent_off() {
    let at = |period: u32| documented(Ticks { period, high: period / 2 });
    // 29.4 and 30.6 Hz.
    for period in [2_857_142, 2_745_098, 2_660_000, 2_940_000] {
        assert!((at(period).unwrap() - 180_000_000).abs() <= 200);
    }
    for period in [0, 2_659_999, 2_940_001, u32::MAX] {
        let fault = PwmFault::Period { period, shortest: 2_660_000, longest: 2_940_000 };
        assert_eq!(at(period), Err(fault));
    }
    let strict = Limits { period_tolerance_ppm: 0, ..Limits::new(TIMER_HZ) };
    assert!(measure(ticks(PERIOD / 2), &strict, Law::Documented).is_ok());
    let one_more = Ticks { period: PERIOD + 1, high: PERIOD / 2 };
    assert!(measure(one_more, &strict, Law::Documented).is_err());
    let any = Limits { period_tolerance_ppm: u32::MAX, ..Limits::new(u32::MAX) };
    assert!(measure(Ticks { period: 2, high: 1 }, &any, Law::Documented).is_ok());
}

/// A module off by up to 5 %, measured with a clock off by −8 to +4.5 % (DS8626 table 39): none is refused, and the angle is
/// the same as with a right clock.
#[test]
fn a_clock_that_is_off_does_not_change_the_angle() {
    let wide = Limits::new(TIMER_HZ).with_clock_error(80_000);
    let mut refused_without = 0;
    for module in (-50..=50).map(|permille| 1.0 + f64::from(permille) / 1_000.0) {
        for clock in (-80..=45).map(|permille| 1.0 + f64::from(permille) / 1_000.0) {
            // Ticks are counted by the clock that is off.
            let count = |duty: f64| (f64::from(PERIOD) * module * clock * duty).round() as u32;
            for duty in [0.2334, 0.3, 0.5, 0.7666] {
                let ticks = Ticks { period: count(1.0), high: count(duty) };
                let angle = measure(ticks, &wide, Law::Documented).expect("a cycle").angle.udeg();
                let expected = 674_900_000.0 * duty - 157_450_000.0;
                // Each count is off by half a tick: 675° in 2.45 million, twice.
                assert!((f64::from(angle) - expected).abs() <= 600.0, "{module} {clock} {duty}: {angle}");
                refused_without += u32::from(documented(ticks).is_err());
            }
        }
    }
    assert!(refused_without > 10_000, "it matters: {refused_without}");
    for (period, is_right) in [(2_424_800, true), (3_175_200, true), (2_424_799, false), (3_175_201, false)] {
        let ticks = Ticks { period, high: period / 2 };
        assert_eq!(
            measure(ticks, &wide, Law::Documented).is_ok(),
            is_right,
            "2.8 million ± 13.4 %: {period}"
        );
    }
}

#[test]
fn a_right_clock_changes_no_limit_and_no_error_is_too_large() {
    let limits = Limits::new(TIMER_HZ);
    assert_eq!(limits.with_clock_error(0), limits);
    for sensor in [0, 50_000, u32::MAX] {
        let wide = Limits { period_tolerance_ppm: sensor, ..limits }.with_clock_error(u32::MAX);
        assert_eq!(wide.period_tolerance_ppm, 1_000_000);
    }
}

#[test]
fn the_duty_has_a_window_with_some_slack() {
    let duty = |ppm: u64| ticks((u64::from(PERIOD) * ppm / 1_000_000) as u32);
    // Within the documented range the line is followed.
    let reading = |ppm| measure(duty(ppm), &Limits::new(TIMER_HZ), Law::Documented).unwrap();
    assert_eq!(reading(233_300).angle.udeg(), 4_170);
    assert!(!reading(233_300).clamped && !reading(766_600).clamped);
    // A trembling step at either end is clamped.
    assert_eq!((reading(233_000).angle, reading(233_000).clamped), (Angle::ZERO, true));
    assert_eq!((reading(232_800).angle, reading(232_800).clamped), (Angle::ZERO, true));
    assert_eq!((reading(766_900).angle.udeg(), reading(766_900).clamped), (359_999_999, true));
    assert_eq!((reading(767_200).angle.udeg(), reading(767_200).duty_ppm), (359_999_999, 767_200));
    // Farther outside is a fault.
    let fault = |ppm: u64| documented(duty(ppm)).unwrap_err();
    assert_eq!(fault(232_799), PwmFault::DutyBelow { duty_ppm: 232_799, min_ppm: 232_800 });
    assert_eq!(fault(767_201), PwmFault::DutyAbove { duty_ppm: 767_201, max_ppm: 767_200 });
    assert_eq!(fault(0), PwmFault::DutyBelow { duty_ppm: 0, min_ppm: 232_800 });
    assert_eq!(fault(1_000_000), PwmFault::DutyAbove { duty_ppm: 1_000_000, max_ppm: 767_200 });
}

#[test]
fn a_pulse_longer_than_its_period_is_a_lost_edge() {
    let lost = ticks(PERIOD + 1);
    assert_eq!(documented(lost), Err(PwmFault::HighBeyondPeriod { ticks: lost }));
}

#[test]
fn faults_say_what_was_seen() {
    let texts = [
        PwmFault::Period { period: 1, shortest: 2, longest: 3 }.to_string(),
        PwmFault::HighBeyondPeriod { ticks: Ticks { period: 4, high: 5 } }.to_string(),
        PwmFault::DutyBelow { duty_ppm: 6, min_ppm: 7 }.to_string(),
        PwmFault::DutyAbove { duty_ppm: 9, max_ppm: 8 }.to_string(),
    ];
    assert_eq!(
        texts,
        [
            "period of 1 ticks is not in 2..=3",
            "pulse of 5 ticks in a period of 4",
            "duty of 6 ppm is below 7",
            "duty of 9 ppm is above 8",
        ]
    );
}
