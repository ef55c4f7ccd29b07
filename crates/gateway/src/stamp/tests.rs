//! Stamps against the instants they were made of, up to ages that no setting allows and no uptime has reached yet.

use super::*;
use clino_bus::Instant;
use proptest::prelude::*;

const SECOND: u64 = 1_000_000;
const DAY: u64 = 86_400 * SECOND;

/// Where a 32-bit count of µs turns negative and where it comes round, where one of ms comes round; and a year.
const SEAMS: [u64; 5] = [1 << 31, 1 << 32, 1_000 << 31, 1_000 << 32, 365 * DAY];

#[test]
fn ages_are_right_on_both_sides_of_every_seam() {
    for made in SEAMS.into_iter().flat_map(|seam| [seam - 1, seam, seam + 1]).chain([0, 1]) {
        for passed in SEAMS.into_iter().flat_map(|seam| [seam - 1, seam, seam + 1]).chain([
            0,
            1,
            SECOND,
            3_600 * SECOND,
        ]) {
            let (at, now) = (Instant::from_micros(made), Instant::from_micros(made + passed));
            assert_eq!(Stamp::of(at).near(now), at, "{made} seen {passed} later");
            assert_eq!(Stamp::of(at).micros_ago(now), passed, "{made} seen {passed} later");
        }
    }
}

#[test]
fn an_instant_to_come_has_no_age() {
    for now in SEAMS.into_iter().chain([0]) {
        let at = Instant::from_micros(now + 540_000);
        assert_eq!(
            (
                Stamp::of(at).near(Instant::from_micros(now)),
                Stamp::of(at).micros_ago(Instant::from_micros(now))
            ),
            (at, 0)
        );
    }
}

#[test]
fn the_longest_age_is_years_and_longer_than_every_setting() {
    // Eight years; a stale limit of an hour, a period of twenty minutes.
    let longest = [8 * 365 * DAY, 3_600 * SECOND, 1_200 * SECOND];
    assert!(longest.into_iter().all(|span| LONGEST_AGE > span), "{longest:?}");
    assert_eq!(
        Stamp::of(Instant::from_micros(7)).micros_ago(Instant::from_micros(7 + LONGEST_AGE)),
        LONGEST_AGE
    );
    assert_eq!(size_of::<Stamp>(), 6);
}

/// Where the 24 bits come round, and where 32 do.
#[test]
fn a_short_stamp_is_exact_on_both_sides_of_every_seam() {
    for now in [1_u64 << 24, 3 << 24, 1 << 32, 5 << 40].into_iter().flat_map(|seam| seam - 2..seam + 2) {
        // A second ahead, 15 s ago.
        for at in [now + SECOND, now + 1, now, now - 1, now - 2, now - 3, now - 15 * SECOND] {
            let (at, now) = (Instant::from_micros(at), Instant::from_micros(now));
            assert_eq!(ShortStamp::of(at).near(now), at, "seen at {now:?}");
        }
    }
    assert_eq!(size_of::<ShortStamp>(), 3);
}

#[test]
fn right_after_reset_a_short_stamp_is_exact() {
    for (at, now) in [(0, 0), (0, 1), (1, 0), (0, 15 * SECOND), (SECOND, 0), (5, 16 * SECOND - SECOND + 5)] {
        let (at, now) = (Instant::from_micros(at), Instant::from_micros(now));
        assert_eq!(ShortStamp::of(at).near(now), at, "seen at {now:?}");
    }
}

proptest! {
    #[test]
    fn a_short_stamp_that_is_looked_at_soon_is_exact(at in 0_u64..1 << 60, later in -1_000_000_i64..15_000_000) {
        let now = Instant::from_micros(at.saturating_add_signed(later));
        let at = Instant::from_micros(at);
        prop_assert_eq!(ShortStamp::of(at).near(now), at);
    }

    #[test]
    fn every_age_that_fits_is_exact(made in 0_u64..1 << 60, passed in 0..=LONGEST_AGE) {
        prop_assert_eq!(Stamp::of(Instant::from_micros(made)).micros_ago(Instant::from_micros(made + passed)), passed);
    }
}
