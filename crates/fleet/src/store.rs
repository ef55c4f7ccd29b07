//! Messages that wait for the broker, on disk: a table in a `redb` database, by number.
//!
//! A transaction is whole or not there at all after a crash, and what a commit has returned for is on the disk.

use std::ops::Range;
use std::path::Path;

use redb::{
    Database, ReadableDatabase as _, ReadableTable as _, ReadableTableMetadata as _, TableDefinition,
};

/// A message for the broker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Where it goes.
    pub topic: String,
    /// What it says.
    pub payload: Vec<u8>,
    /// Whether the broker keeps it for those who come later.
    pub retain: bool,
}

const QUEUE: TableDefinition<'_, u64, &[u8]> = TableDefinition::new("queue");
const COUNTERS: TableDefinition<'_, &str, u64> = TableDefinition::new("counters");
/// Starts of this bridge.
const RUNS: &str = "runs";
/// The number behind the last message that was ever stored.
const END: &str = "end";
/// Bytes that the messages of the queue take.
const BYTES: &str = "bytes";

/// What was found when the store was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Opened {
    /// Starts of this bridge, this one included.
    pub run: u64,
    /// Numbers of the messages that wait.
    pub waiting: Range<u64>,
    /// Bytes that they take.
    pub bytes: u64,
}

/// The store.
pub struct Store {
    database: Database,
}

/// A commit: what is added, and which numbers are no longer needed.
#[derive(Debug)]
pub struct Change<'a> {
    /// Numbers and messages, ascending.
    pub add: &'a [(u64, &'a Message)],
    /// Everything below this number goes.
    pub keep_from: u64,
}

impl Message {
    /// Bytes that it takes.
    pub fn size(&self) -> u64 {
        (HEAD + self.topic.len() + self.payload.len()) as u64
    }

    fn encode(&self) -> Vec<u8> {
        let length = u16::try_from(self.topic.len()).unwrap_or(u16::MAX);
        let mut bytes = Vec::with_capacity(HEAD + self.topic.len() + self.payload.len());
        bytes.push(self.retain.into());
        bytes.extend(length.to_be_bytes());
        bytes.extend(self.topic.bytes().take(length.into()));
        bytes.extend(&self.payload);
        bytes
    }

    fn decode(bytes: &[u8]) -> Option<Message> {
        let (&[retain, high, low], rest) = bytes.split_first_chunk()?;
        let (topic, payload) = rest.split_at_checked(u16::from_be_bytes([high, low]).into())?;
        Some(Message {
            topic: String::from_utf8(topic.to_vec()).ok()?,
            payload: payload.to_vec(),
            retain: retain != 0,
        })
    }
}

/// Whether it is retained, and the length of its topic.
const HEAD: usize = 3;

impl Store {
    /// Opens or makes it. This counts as a start.
    pub fn open(path: &Path) -> Result<(Store, Opened), String> {
        let named = |why: &dyn std::fmt::Display| format!("{}: {why}", path.display());
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|why| named(&why))?;
        }
        let database = Database::create(path).map_err(|why| named(&why))?;
        let store = Store { database };
        let opened = store.begin().map_err(|why| named(&why))?;
        Ok((store, opened))
    }

    fn begin(&self) -> Result<Opened, redb::Error> {
        let transaction = self.database.begin_write()?;
        let opened = {
            let queue = transaction.open_table(QUEUE)?;
            let mut counters = transaction.open_table(COUNTERS)?;
            let counter = |name: &str, counters: &redb::Table<'_, &str, u64>| -> Result<u64, redb::Error> {
                Ok(counters.get(name)?.map_or(0, |value| value.value()))
            };
            let run = counter(RUNS, &counters)? + 1;
            counters.insert(RUNS, run)?;
            let first = queue.first()?.map(|(number, _)| number.value());
            let end = counter(END, &counters)?;
            Opened { run, waiting: first.unwrap_or(end)..end, bytes: counter(BYTES, &counters)? }
        };
        transaction.commit()?;
        Ok(opened)
    }

    /// Commits a change; returns how many bytes wait afterwards.
    pub fn commit(&self, change: &Change<'_>) -> Result<u64, String> {
        self.change(change).map_err(|why| why.to_string())
    }

    fn change(&self, change: &Change<'_>) -> Result<u64, redb::Error> {
        let transaction = self.database.begin_write()?;
        let bytes = {
            let mut queue = transaction.open_table(QUEUE)?;
            let mut counters = transaction.open_table(COUNTERS)?;
            let mut bytes = counters.get(BYTES)?.map_or(0, |value| value.value());
            for (number, message) in change.add {
                queue.insert(number, message.encode().as_slice())?;
                bytes = bytes.saturating_add(message.size());
            }
            if let Some((last, _)) = change.add.last() {
                counters.insert(END, last + 1)?;
            }
            queue.retain_in(..change.keep_from, |_, stored| {
                bytes = bytes.saturating_sub(stored.len() as u64);
                false
            })?;
            if queue.is_empty()? {
                bytes = 0;
            }
            counters.insert(BYTES, bytes)?;
            bytes
        };
        transaction.commit()?;
        Ok(bytes)
    }

    /// The messages with these numbers, as many as there are up to this many. One that cannot be read is left out.
    pub fn read(&self, numbers: Range<u64>, most: usize) -> Result<Vec<(u64, Message)>, String> {
        self.look(numbers, most).map_err(|why| why.to_string())
    }

    fn look(&self, numbers: Range<u64>, most: usize) -> Result<Vec<(u64, Message)>, redb::Error> {
        let transaction = self.database.begin_read()?;
        let queue = transaction.open_table(QUEUE)?;
        let mut found = Vec::new();
        for entry in queue.range(numbers)?.take(most) {
            let (number, stored) = entry?;
            if let Some(message) = Message::decode(stored.value()) {
                found.push((number.value(), message));
            }
        }
        Ok(found)
    }

    /// The number of the message up to which (exclusive) this many bytes are freed.
    pub fn number_after(&self, bytes: u64) -> Result<u64, String> {
        self.sum(bytes).map_err(|why| why.to_string())
    }

    fn sum(&self, bytes: u64) -> Result<u64, redb::Error> {
        let transaction = self.database.begin_read()?;
        let queue = transaction.open_table(QUEUE)?;
        let (mut freed, mut number) = (0_u64, 0);
        for entry in queue.iter()? {
            let (key, stored) = entry?;
            if freed >= bytes {
                break;
            }
            freed += stored.value().len() as u64;
            number = key.value() + 1;
        }
        Ok(number)
    }
}
