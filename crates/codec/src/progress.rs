//! The three-way answer of every streaming decoder.

use crate::stream::Verdict;

/// What one more character led to.
///
/// [`DecodeProgress::Bad`] does not end the wait for a frame: the decoder has already resynchronised, and a good
/// frame that follows the bad bytes (or began among them) still comes out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum DecodeProgress<T, E> {
    /// Nothing complete yet.
    More,
    /// A frame that passed every check that is switched on.
    Frame(T),
    /// Bytes that began like a frame and turned out not to be a good one, and why.
    Bad(E),
}

impl<T, E> DecodeProgress<T, E> {
    /// Takes the result of examining these bytes and returns what it means for them.
    #[inline(always)]
    pub(crate) fn settle(&mut self, result: Result<T, E>, length: usize) -> Verdict {
        match result {
            Ok(frame) => {
                *self = Self::Frame(frame);
                Verdict::Frame(length)
            }
            Err(error) => {
                *self = Self::Bad(error);
                Verdict::Bad(length)
            }
        }
    }
}
