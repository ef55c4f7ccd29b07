//! Virtual time against the wall clock.
//!
//! Virtual time never leads. A short delay is made up for; a longer one is not: the run goes on from where it is, as
//! if the clock had stood still, and says how much that came to.

use std::time::Duration;

use clino_sim::node::Ns;

/// The longest delay that is made up for: as long as a busy computer may keep a program waiting now and then, and
/// short enough that a program on the line does not notice the hurry.
const MADE_UP_FOR: Duration = Duration::from_millis(50);
/// From one complaint to the next.
const BETWEEN_COMPLAINTS: Duration = Duration::from_secs(5);

/// Keeps pace. All times of the wall clock count from the beginning of the run.
#[derive(Debug, Default)]
pub struct Pace {
    /// How long the clock has stood still so far.
    lost: Duration,
    complained: Complaint,
}

/// How far the run has fallen behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Complaint {
    /// Of the wall clock, since the beginning.
    pub at: Duration,
    /// Time lost since the beginning.
    pub lost: Duration,
}

impl Pace {
    /// Virtual time has come to `reached` when the wall clock shows `wall`: how long to wait before it goes on.
    pub fn wait(&mut self, reached: Ns, wall: Duration) -> Duration {
        let due = Duration::from_nanos(reached) + self.lost;
        let late = wall.saturating_sub(due);
        if late > MADE_UP_FOR {
            self.lost += late;
        }
        due.saturating_sub(wall)
    }

    /// How long the clock has stood still in all.
    pub fn lost(&self) -> Duration {
        self.lost
    }

    /// The time lost, and in how long, if it is time to speak of it.
    pub fn complaint(&mut self, wall: Duration) -> Option<Complaint> {
        let passed = wall.saturating_sub(self.complained.at);
        if passed < BETWEEN_COMPLAINTS {
            return None;
        }
        let lost = self.lost.saturating_sub(self.complained.lost);
        self.complained = Complaint { at: wall, lost: self.lost };
        (lost > Duration::ZERO).then_some(Complaint { at: passed, lost })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Ns = 1_000_000;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn virtual_time_waits_for_the_wall_clock() {
        let mut pace = Pace::default();
        assert_eq!(pace.wait(10 * MS, ms(4)), ms(6));
        assert_eq!(pace.wait(11 * MS, ms(11)), ms(0));
    }

    #[test]
    fn a_short_delay_is_made_up_for_and_a_long_one_is_lost() {
        let mut pace = Pace::default();
        assert_eq!(pace.wait(10 * MS, ms(60)), ms(0));
        assert_eq!((pace.lost(), pace.wait(60 * MS, ms(61))), (ms(0), ms(0)));
        assert_eq!(pace.wait(61 * MS, ms(161)), ms(0));
        assert_eq!(pace.lost(), ms(100));
        assert_eq!(pace.wait(62 * MS, ms(161)), ms(1));
    }

    #[test]
    fn it_complains_at_intervals_and_only_of_what_is_new() {
        let mut pace = Pace::default();
        pace.wait(0, ms(3_000));
        assert_eq!(pace.complaint(ms(4_999)), None);
        assert_eq!(pace.complaint(ms(5_000)), Some(Complaint { at: ms(5_000), lost: ms(3_000) }));
        assert_eq!(pace.complaint(ms(10_000)), None);
        pace.wait(10_000 * MS, ms(14_000));
        assert_eq!(pace.complaint(ms(16_000)), Some(Complaint { at: ms(6_000), lost: ms(1_000) }));
    }
}
