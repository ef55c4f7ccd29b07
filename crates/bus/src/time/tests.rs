use proptest::prelude::*;

use super::*;
use crate::Serial;

const HOUR_US: u64 = 3_600_000_000;
/// 2^63 - 1: the last instant there is.
const LAST_US: u64 = 9_223_372_036_854_775_807;

#[test]
fn what_does_not_fit_saturates() {
    let second = Duration::from_millis(1_000);
    assert_eq!(Instant::from_micros(u64::MAX), Instant::NEVER);
    assert_eq!(Instant::from_millis(999) - second, Instant::ZERO);
    assert_eq!(Duration::MAX + second, Duration::MAX);
    assert_eq!(Duration::ZERO - second, Duration::ZERO);
    assert_eq!(second.times(4_294), Duration::from_micros(4_294_000_000));
    assert_eq!(second.times(4_295), Duration::MAX);
    assert_eq!(Duration::from_millis(4_294_967).as_millis(), 4_294_967);
    assert_eq!(Duration::from_millis(4_294_968), Duration::MAX);
    assert_eq!(Instant::from_millis(u32::MAX).as_micros(), 4_294_967_295_000);
}

/// No sum comes round: the latest instant and a long chain of the longest durations.
#[test]
fn a_sum_is_later_than_what_it_is_made_of() {
    assert_eq!(Instant::NEVER.as_micros(), LAST_US);
    let mut at = Instant::NEVER;
    for _ in 0..1_000_000 {
        let next = at + Duration::MAX;
        assert!(next > at && next.since(at) == Duration::MAX);
        at = next;
    }
}

/// The longest settings are an hour. That time is told from any that is longer.
#[test]
fn an_hour_is_exact() {
    let (begin, hour) = (Instant::from_micros(u64::from(u32::MAX)), Duration::from_millis(3_600_000));
    for us in [HOUR_US - 1, HOUR_US, HOUR_US + 1, 1 << 32, 8_766 * HOUR_US] {
        let now = Instant::from_micros(begin.as_micros() + us);
        assert_eq!(now.since(begin) > hour, us > HOUR_US, "{us}");
        assert_eq!(now > begin + hour, us > HOUR_US, "{us}");
        assert_eq!(begin.since(now), Duration::ZERO);
    }
}

proptest! {
    #[test]
    fn ages_are_exact(earlier in 0..=LAST_US, later in 0..=LAST_US) {
        let (one, other) = (Instant::from_micros(earlier), Instant::from_micros(later));
        let us = u128::from(later).saturating_sub(earlier.into());
        prop_assert_eq!(u128::from(other.micros_since(one)), us);
        prop_assert_eq!(u128::from(other.millis_since(one)), us / 1_000);
        prop_assert_eq!(u128::from(other.since(one).as_micros()), us.min(u32::MAX.into()));
    }

    #[test]
    fn ages_near_the_end_of_a_duration_are_exact(earlier in any::<u32>(), us in (1_u64 << 32) - 5_000..(1 << 32) + 5_000) {
        let earlier = Instant::from_micros(earlier.into());
        let later = Instant::from_micros(earlier.as_micros() + us);
        prop_assert_eq!(later.millis_since(earlier), us / 1_000);
        prop_assert_eq!(u64::from(later.since(earlier).as_micros()), us.min(u32::MAX.into()));
    }

    /// Near the border of the two words that an instant is made of, and anywhere.
    #[test]
    fn instants_have_the_order_of_their_numbers(
        (one, other) in prop_oneof![
            (0..=LAST_US, 0..=LAST_US),
            ((1_u64 << 32) - 3..(1 << 32) + 3, (1_u64 << 32) - 3..(1 << 32) + 3),
        ],
        us in any::<u32>(),
    ) {
        let [first, second] = [one, other].map(Instant::from_micros);
        prop_assert_eq!(first.cmp(&second), one.cmp(&other));
        prop_assert_eq!(first.partial_cmp(&second), Some(one.cmp(&other)));
        prop_assert_eq!(first == second, one == other);
        prop_assert_eq!(first.as_micros(), one);
        let sum = first + Duration::from_micros(us);
        prop_assert_eq!(u128::from(sum.as_micros()), u128::from(one) + u128::from(us));
        prop_assert_eq!(sum - Duration::from_micros(us), first);
    }

    /// Exact as far as a frame goes, and never shorter.
    #[test]
    fn the_time_of_bits_is_rounded_up(baud in 1_u32..4_000_000, bits in prop_oneof![0_u32..6_000, any::<u32>()]) {
        let us = u64::from(Serial { baud }.bits(bits).as_micros());
        let exact = (u128::from(bits) * 1_000_000).div_ceil(baud.into()).min(u32::MAX.into()) as u64;
        if bits <= 4_294 {
            prop_assert_eq!(us, exact);
        }
        prop_assert!(exact <= us, "{us} is less than {exact}");
    }
}
