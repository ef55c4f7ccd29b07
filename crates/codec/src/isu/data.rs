//! Contents of module memory as messages carry them. Source: AN #201 appendix A.

use crate::bytes::Buffer;

/// Most RAM bytes in one message. The length byte counts to 255, head and address among it: that are 253, with the feature
/// `long-messages`. Without it 32: the 16 words of EEPROM that are the most the document ever lets a host write at once
/// (section 6). A host that asks for no more at once needs no more, and all that carries a message is an eighth as large.
pub const MAX_DATA: usize = if cfg!(feature = "long-messages") { u8::MAX as usize - 2 } else { 32 };
/// Most EEPROM words in one message.
pub const MAX_WORDS: usize = MAX_DATA / 2;

/// Up to [`MAX_DATA`] bytes of RAM.
#[derive(Clone, Copy)]
pub struct Data(Buffer<MAX_DATA>);

impl Data {
    /// A copy of these bytes; `None` when they are too many for a message.
    pub fn new(bytes: &[u8]) -> Option<Self> {
        (bytes.len() <= MAX_DATA).then(|| Self::first(bytes))
    }

    /// Bytes that stand there.
    pub(super) const fn of(bytes: Buffer<MAX_DATA>) -> Self {
        Self(bytes)
    }

    /// As many of these bytes as fit.
    pub(super) fn first(bytes: &[u8]) -> Self {
        Self(Buffer::first(bytes))
    }

    /// The bytes.
    pub fn as_slice(&self) -> &[u8] {
        self.0.as_slice()
    }
}

/// Up to [`MAX_WORDS`] words of EEPROM.
///
/// ```
/// use clino_codec::isu::Words;
///
/// let words = Words::new(&[0x1234, 0xABCD]).unwrap();
/// assert!(words.iter().eq([0x1234, 0xABCD]));
/// ```
#[derive(Clone, Copy)]
pub struct Words(Buffer<MAX_DATA>);

impl Words {
    /// A copy of these words; `None` when they are too many for a message.
    pub fn new(words: &[u16]) -> Option<Self> {
        (words.len() <= MAX_WORDS).then(|| Self::first(words))
    }

    /// As many of these words as fit.
    #[inline(never)]
    pub(super) fn first(words: &[u16]) -> Self {
        let mut buffer = Buffer::new();
        words.iter().take(MAX_WORDS).for_each(|word| buffer.extend(&word.to_be_bytes()));
        Self(buffer)
    }

    /// As many of these words, high byte first, as fit.
    pub(super) fn from_be_bytes(bytes: &[u8]) -> Self {
        Self::of(Buffer::first(bytes))
    }

    /// Words that stand there, high byte first.
    pub(super) const fn of(bytes: Buffer<MAX_DATA>) -> Self {
        Self(bytes)
    }

    /// High byte first.
    pub fn as_be_bytes(&self) -> &[u8] {
        self.0.as_slice()
    }

    /// How many words there are.
    pub fn len(&self) -> usize {
        self.as_be_bytes().len() / 2
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The words in order.
    pub fn iter(&self) -> impl Iterator<Item = u16> {
        self.as_be_bytes().as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair))
    }
}

impl PartialEq for Data {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl Eq for Data {}

impl PartialEq for Words {
    fn eq(&self, other: &Self) -> bool {
        self.as_be_bytes() == other.as_be_bytes()
    }
}

impl Eq for Words {}

impl core::fmt::Debug for Data {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{:02X?}", self.as_slice())
    }
}

impl core::fmt::Debug for Words {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(feature = "defmt")]
mod defmt_support {
    use super::{Data, Words};

    impl defmt::Format for Data {
        fn format(&self, f: defmt::Formatter<'_>) {
            defmt::write!(f, "{=[u8]:02X}", self.as_slice());
        }
    }

    impl defmt::Format for Words {
        fn format(&self, f: defmt::Formatter<'_>) {
            defmt::write!(f, "{=[u8]:02X}", self.as_be_bytes());
        }
    }
}

/// Both are sequences of numbers.
#[cfg(feature = "serde")]
mod serde_support {
    use core::fmt;

    use serde::de::{Error, SeqAccess, Visitor};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{Buffer, Data, MAX_DATA, MAX_WORDS, Words};

    impl Serialize for Data {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_seq(self.as_slice())
        }
    }

    impl Serialize for Words {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_seq(self.iter())
        }
    }

    impl<'de> Deserialize<'de> for Data {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_seq(DataVisitor)
        }
    }

    impl<'de> Deserialize<'de> for Words {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            deserializer.deserialize_seq(WordsVisitor)
        }
    }

    struct DataVisitor;

    impl<'de> Visitor<'de> for DataVisitor {
        type Value = Data;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "at most {MAX_DATA} bytes")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Data, A::Error> {
            let mut buffer = Buffer::new();
            let mut count = 0;
            while let Some(byte) = seq.next_element()? {
                buffer.push(byte);
                count += 1;
                if count > MAX_DATA {
                    return Err(A::Error::invalid_length(count, &self));
                }
            }
            Ok(Data(buffer))
        }
    }

    struct WordsVisitor;

    impl<'de> Visitor<'de> for WordsVisitor {
        type Value = Words;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "at most {MAX_WORDS} words")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Words, A::Error> {
            let mut buffer = Buffer::new();
            let mut count = 0;
            while let Some(word) = seq.next_element::<u16>()? {
                buffer.extend(&word.to_be_bytes());
                count += 1;
                if count > MAX_WORDS {
                    return Err(A::Error::invalid_length(count, &self));
                }
            }
            Ok(Words(buffer))
        }
    }
}
