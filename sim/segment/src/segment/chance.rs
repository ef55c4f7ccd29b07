//! Chance without state: every decision is a hash of the seed, the node and the time, so that it does not
//! depend on the order in which decisions are taken and the same scenario always runs the same way.

/// What a decision is about; keeps decisions about the same instant independent of each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub enum Topic {
    /// Level of a line that two drivers fight over.
    Fight = 1,
    /// Bit errors.
    Flip,
    /// Lost characters.
    Drop,
    /// Bytes of a babbling node.
    Babble,
    /// Corrupted answers.
    Corrupt,
    /// Shortened answers.
    Shorten,
    /// Seeds handed to others.
    Seed,
    /// Impairments of a line that is no bus.
    Impair,
}

/// The seed of a run or of a part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chance(u64);

impl Chance {
    /// Chance of a whole run.
    pub fn new(seed: u64) -> Self {
        Self(mix(seed))
    }

    /// Independent chance for one part of the whole (a segment, a node).
    pub fn part(self, number: u64) -> Self {
        Self(self.roll(Topic::Seed, number, 0))
    }

    /// 64 random bits that depend on the seed and the arguments alone.
    pub fn roll(self, topic: Topic, a: u64, b: u64) -> u64 {
        mix(mix(mix(self.0 ^ topic as u64).wrapping_add(a)).wrapping_add(b))
    }

    /// Whether something of this probability happens.
    pub fn hit(self, probability: Probability, topic: Topic, a: u64, b: u64) -> bool {
        probability.0 != 0 && (self.roll(topic, a, b) >> 32) < probability.0
    }
}

/// A probability in units of 2⁻³².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Probability(u64);

impl Probability {
    /// It never happens.
    pub const NEVER: Self = Self(0);

    /// From a number in 0…1; `None` for anything else. Resolution 2⁻³², 2.3e-10.
    pub fn new(value: f64) -> Option<Self> {
        (0.0..=1.0).contains(&value).then(|| Self((value * 4_294_967_296.0).round() as u64))
    }
}

/// The output function of SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators",
/// OOPSLA 2014), with its additive constant.
fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_outputs_of_splitmix64_with_seed_zero() {
        // Published test vector: state 0, first two outputs.
        assert_eq!(mix(0), 0xE220_A839_7B1D_CDAF);
        assert_eq!(mix(0x9E37_79B9_7F4A_7C15), 0x6E78_9E6A_A1B9_65F4);
    }

    #[test]
    fn hits_come_as_often_as_asked() {
        let chance = Chance::new(7);
        for (probability, expected) in [(0.0, 0), (1.0, 100_000), (0.25, 25_000), (0.001, 100)] {
            let wanted = Probability::new(probability).unwrap();
            let hits = (0..100_000).filter(|&n| chance.hit(wanted, Topic::Flip, n, 3)).count();
            // Four standard deviations of a binomial distribution.
            let slack = 4.0 * (100_000.0 * probability * (1.0 - probability)).sqrt();
            assert!((hits as f64 - f64::from(expected)).abs() <= slack, "{probability}: {hits}");
        }
    }

    #[test]
    fn only_numbers_from_zero_to_one_are_probabilities() {
        assert!(Probability::new(-0.1).is_none());
        assert!(Probability::new(1.1).is_none());
        assert!(Probability::new(f64::NAN).is_none());
    }

    #[test]
    fn topics_parts_and_seeds_are_independent() {
        let rolls = [
            Chance::new(1).roll(Topic::Flip, 5, 6),
            Chance::new(2).roll(Topic::Flip, 5, 6),
            Chance::new(1).roll(Topic::Drop, 5, 6),
            Chance::new(1).roll(Topic::Flip, 6, 5),
            Chance::new(1).part(0).roll(Topic::Flip, 5, 6),
        ];
        for (n, roll) in rolls.iter().enumerate() {
            assert!(!rolls[..n].contains(roll));
        }
    }
}
