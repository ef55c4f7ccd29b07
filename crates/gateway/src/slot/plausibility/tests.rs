//! What is published, held back, and suspected.

use super::*;
use proptest::prelude::*;

/// 0.05°, 100°/s, a second.
const DEMANDS: Demands =
    Demands { resolution: 50_000, max_rate: 100_000, life: Duration::from_micros(1_000_000) };

/// The longest stale limit that the settings allow: an hour.
const LONGEST_STALE: Duration = Duration::from_micros(3_600_000_000);

fn mdeg(mdeg: i32) -> Angle {
    Angle::from_udeg(mdeg * 1_000)
}

/// A slot with its plausibility check.
struct Slot {
    check: Plausibility,
    last: Option<(Angle, Instant)>,
}

impl Slot {
    fn new() -> Slot {
        Slot { check: Plausibility::NEW, last: None }
    }

    fn take(&mut self, value: Angle, ms: u64) -> Acceptance {
        let at = Instant::from_micros(ms * 1_000);
        let acceptance = self.check.judge(value, at, self.last, &DEMANDS);
        if acceptance == Acceptance::Publish {
            self.last = Some((value, at));
        }
        acceptance
    }
}

#[test]
fn the_first_value_is_held_until_one_agrees() {
    let mut slot = Slot::new();
    assert_eq!(slot.take(mdeg(10_000), 0), Acceptance::Hold);
    assert!(slot.check.wants_confirmation());
    // 0.05° and 20 ms at 100°/s: 2.05°.
    assert_eq!(slot.take(mdeg(12_051), 20), Acceptance::Suspect);
    assert!(!slot.check.wants_confirmation(), "once out of turn is enough");
    assert_eq!(slot.take(mdeg(14_101), 40), Acceptance::Publish);
    assert_eq!(slot.take(mdeg(14_200), 60), Acceptance::Publish);
}

#[test]
fn a_jump_is_held_and_motion_is_not() {
    let mut slot = Slot::new();
    slot.take(mdeg(179_900), 0);
    assert_eq!(slot.take(mdeg(179_900), 20), Acceptance::Publish);
    // Across the seam, at the limit.
    assert_eq!(slot.take(mdeg(-178_050), 40), Acceptance::Publish);
    assert_eq!(slot.take(mdeg(-175_999), 60), Acceptance::Hold);
    // A jump that was none: the value is where it was.
    assert_eq!(slot.take(mdeg(-178_050), 80), Acceptance::Suspect);
    assert_eq!(slot.take(mdeg(-178_050), 100), Acceptance::Publish);
}

#[test]
fn after_damage_a_value_needs_a_confirmation() {
    let mut slot = Slot::new();
    slot.take(mdeg(1), 0);
    slot.take(mdeg(1), 20);
    slot.check.distrust();
    assert_eq!(slot.take(mdeg(1), 40), Acceptance::Hold);
    // More damage does not make the candidate worse.
    slot.check.distrust();
    assert_eq!(slot.take(mdeg(1), 60), Acceptance::Publish);
    assert_eq!(slot.take(mdeg(1), 80), Acceptance::Publish);
}

#[test]
fn an_old_candidate_confirms_nothing() {
    let mut slot = Slot::new();
    slot.take(mdeg(1), 0);
    assert_eq!(slot.take(mdeg(1), 1_001), Acceptance::Hold);
    slot.check.forget();
    assert_eq!(slot.take(mdeg(1), 1_021), Acceptance::Hold);
    assert_eq!(slot.take(mdeg(1), 1_041), Acceptance::Publish);
}

#[test]
fn without_a_limit_nothing_is_a_jump() {
    let any = Demands { max_rate: 0, ..DEMANDS };
    let mut check = Plausibility::NEW;
    assert_eq!(check.judge(mdeg(0), Instant::from_micros(0), None, &any), Acceptance::Hold);
    assert_eq!(check.judge(mdeg(0), Instant::from_micros(20_000), None, &any), Acceptance::Publish);
    let last = Some((mdeg(0), Instant::from_micros(20_000)));
    assert_eq!(check.judge(mdeg(-180_000), Instant::from_micros(20_001), last, &any), Acceptance::Publish);
}

/// Zero is no limit, and so never stricter than one: whatever a slot with a limit publishes, one without does.
#[test]
fn without_a_limit_a_sensor_that_turns_fast_is_published() {
    for rate in [0, 400_000, 3_600_000] {
        let demands = Demands { max_rate: rate, ..DEMANDS };
        let (mut check, mut last, mut published) = (Plausibility::NEW, None, 0);
        for n in 0..100_u64 {
            // 300°/s, asked every 20 ms; damaged once.
            let (at, value) = (Instant::from_micros(n * 20_000), mdeg(n as i32 * 6_000 % 360_000 - 180_000));
            if n == 50 {
                check.distrust();
            }
            if check.judge(value, at, last, &demands) == Acceptance::Publish {
                (last, published) = (Some((value, at)), published + 1);
            }
        }
        assert_eq!(published, 98, "all but the first, and the first after the damage; limit {rate}");
    }
    // Too old a candidate confirms nothing, limit or not.
    let any = Demands { max_rate: 0, ..DEMANDS };
    let mut check = Plausibility::NEW;
    check.judge(mdeg(1), Instant::from_micros(0), None, &any);
    assert_eq!(check.judge(mdeg(1), Instant::from_micros(1_000_001), None, &any), Acceptance::Hold);
}

/// A second value that is far too late for its candidate is one that needs another, however long the wait was: past
/// 35.8 min and 71.6 min, at which counts of 32 bits turn, 49.7 days, and a year.
#[test]
fn a_candidate_of_long_ago_confirms_nothing() {
    // The longest stale limit that can be set.
    let demands = Demands { life: LONGEST_STALE, ..DEMANDS };
    for wait in [1 << 31, 1 << 32, 1_000 << 32, 365 * 86_400_000_000_u64] {
        for wait in [wait - 1, wait, wait + 1, wait + 20_000] {
            let mut check = Plausibility::NEW;
            check.judge(mdeg(5), Instant::from_micros(1_000), None, &demands);
            let within = wait <= 3_600_000_000;
            let expected = if within { Acceptance::Publish } else { Acceptance::Hold };
            assert_eq!(
                check.judge(mdeg(5), Instant::from_micros(1_000 + wait), None, &demands),
                expected,
                "after {wait} us"
            );
        }
    }
}

/// A reading every 20 minutes, stale after an hour, one reading missed. What has agreed is published.
#[test]
fn values_that_agree_after_forty_minutes_are_no_suspects() {
    let demands = Demands { life: LONGEST_STALE, ..DEMANDS };
    let mut check = Plausibility::NEW;
    assert_eq!(check.judge(mdeg(10_000), Instant::from_micros(0), None, &demands), Acceptance::Hold);
    assert_eq!(
        check.judge(mdeg(10_100), Instant::from_micros(2_400_000_000), None, &demands),
        Acceptance::Publish
    );
}

proptest! {
    /// Whatever comes, a value that is published agrees with the one before it, or with the one published last.
    #[test]
    fn what_is_published_has_a_confirmation(
        values in prop::collection::vec((-180_000..180_000_i32, 1_u64..2_000, any::<bool>()), 1..100)
    ) {
        let close = |one: i32, other: i32, ms: u64| {
            let apart = (one - other).rem_euclid(360_000);
            i64::from(apart.min(360_000 - apart)) <= 50 + 100 * ms as i64
        };
        let mut slot = Slot::new();
        let (mut now, mut before, mut last) = (0, None, None);
        for (value, wait, distrust) in values {
            now += wait;
            if distrust {
                slot.check.distrust();
            }
            if slot.take(mdeg(value), now) == Acceptance::Publish {
                let mut others = [before, last].into_iter().flatten();
                let confirmed = others.any(|(other, then)| close(value, other, now - then));
                prop_assert!(confirmed, "{value} at {now} ms");
                last = Some((value, now));
            }
            before = Some((value, now));
        }
    }
}
