//! Messages that wait for the broker, on disk: tables in a `redb` database, a message by its number.
//!
//! | table | what |
//! |---|---|
//! | `queue`, `queue NAME` | the messages of a lane, by number; the lane without a name is the only one of JSON |
//! | `counters` | `runs`; for each lane `end`, `bytes` (behind them its name, as above) |
//!
//! A transaction is whole or not there at all after a crash, and what a commit has returned for is on the disk. After an error
//! of the disk redb refuses everything: the database is closed then, and opened anew at the next access.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, Instant};

use redb::{
    Database, ReadTransaction, ReadableDatabase as _, ReadableTable as _, ReadableTableMetadata as _,
    TableDefinition, TableError,
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

const COUNTERS: TableDefinition<'_, &str, u64> = TableDefinition::new("counters");
/// Starts of this bridge.
const RUNS: &str = "runs";
/// Table of a lane.
const QUEUE: &str = "queue";
/// The number behind the last message of a lane that was ever stored.
const END: &str = "end";
/// Bytes that the messages of a lane take.
const BYTES: &str = "bytes";
/// Of what is read and written, the most that redb keeps in memory. It would be a gigabyte otherwise.
const CACHE_BYTES: usize = 32_000_000;

/// What was found in a lane when it was opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Opened {
    /// Numbers of the messages that wait.
    pub waiting: Range<u64>,
    /// Bytes that they take.
    pub bytes: u64,
}

/// The database of a bridge.
pub struct Store {
    path: PathBuf,
    access: RwLock<Access>,
    /// Starts of this bridge, this one included.
    run: u64,
}

enum Access {
    Open(Database),
    /// Since when and why, if that was an error.
    Closed(Option<(Instant, String)>),
}

/// From an error to the next try: a file of gigabytes is checked whole when it is opened after one.
const TRY_AGAIN: Duration = Duration::from_secs(2);

/// The messages of one queue.
#[derive(Clone)]
pub struct Lane {
    store: Arc<Store>,
    queue: String,
    end: String,
    bytes: String,
}

/// What changes in a lane: what is added, and which numbers are no longer needed.
#[derive(Debug)]
pub struct Change {
    /// Numbers and messages, ascending.
    pub add: Vec<(u64, Message)>,
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
    pub fn open(path: &Path) -> Result<Arc<Store>, String> {
        let access = RwLock::new(Access::Closed(None));
        let mut store = Store { path: path.to_owned(), access, run: 0 };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|why| store.named(&why))?;
        }
        store.run = store.with(|database| {
            let transaction = database.begin_write()?;
            let run = {
                let mut counters = transaction.open_table(COUNTERS)?;
                let run = counters.get(RUNS)?.map_or(0, |value| value.value()) + 1;
                counters.insert(RUNS, run)?;
                run
            };
            transaction.commit()?;
            Ok(run)
        })?;
        Ok(Arc::new(store))
    }

    /// Starts of this bridge, this one included.
    pub fn run(&self) -> u64 {
        self.run
    }

    fn named(&self, why: &dyn std::fmt::Display) -> String {
        format!("{}: {why}", self.path.display())
    }

    /// Works with the database, which an error closes.
    fn with<T>(&self, work: impl FnOnce(&Database) -> Result<T, redb::Error>) -> Result<T, String> {
        self.open_again()?;
        let access = self.access.read().unwrap_or_else(PoisonError::into_inner);
        let Access::Open(database) = &*access else { return Err(self.named(&"an error has closed it")) };
        let worked = work(database).map_err(|why| self.named(&why));
        drop(access);
        worked.inspect_err(|why| {
            let mut access = self.access.write().unwrap_or_else(PoisonError::into_inner);
            *access = Access::Closed(Some((Instant::now(), why.clone())));
        })
    }

    /// Opens it if an error has closed it, a while ago.
    fn open_again(&self) -> Result<(), String> {
        if matches!(&*self.access.read().unwrap_or_else(PoisonError::into_inner), Access::Open(_)) {
            return Ok(());
        }
        let mut access = self.access.write().unwrap_or_else(PoisonError::into_inner);
        match &*access {
            Access::Open(_) => return Ok(()),
            Access::Closed(Some((since, why))) if since.elapsed() < TRY_AGAIN => return Err(why.clone()),
            Access::Closed(_) => {}
        }
        let opened = Database::builder().set_cache_size(CACHE_BYTES).create(&self.path);
        let opened = opened.map_err(|why| self.named(&why));
        let failed = opened.as_ref().err().cloned();
        *access = match opened {
            Ok(database) => Access::Open(database),
            Err(why) => Access::Closed(Some((Instant::now(), why))),
        };
        failed.map_or(Ok(()), Err)
    }

    /// Commits changes of several lanes, all or none; returns how many bytes wait in each afterwards.
    pub fn commit(&self, changes: &[(&Lane, &Change)]) -> Result<Vec<u64>, String> {
        self.with(|database| {
            let transaction = database.begin_write()?;
            let mut waiting = Vec::new();
            for (lane, change) in changes {
                let mut queue = transaction.open_table(lane.table())?;
                let mut counters = transaction.open_table(COUNTERS)?;
                let mut bytes = counters.get(&*lane.bytes)?.map_or(0, |value| value.value());
                for (number, message) in &change.add {
                    queue.insert(number, message.encode().as_slice())?;
                    bytes = bytes.saturating_add(message.size());
                }
                if let Some((last, _)) = change.add.last() {
                    counters.insert(&*lane.end, last + 1)?;
                }
                queue.retain_in(..change.keep_from, |_, stored| {
                    bytes = bytes.saturating_sub(stored.len() as u64);
                    false
                })?;
                if queue.is_empty()? {
                    bytes = 0;
                }
                counters.insert(&*lane.bytes, bytes)?;
                waiting.push(bytes);
            }
            transaction.commit()?;
            Ok(waiting)
        })
    }
}

impl Lane {
    /// The only lane of a store, or, with a name, one of several.
    ///
    /// # Errors
    /// The store cannot be read.
    pub fn of(store: &Arc<Store>, name: Option<&str>) -> Result<(Lane, Opened), String> {
        let named = |what: &str| name.map_or_else(|| what.to_owned(), |name| format!("{what} {name}"));
        let lane = Lane { store: store.clone(), queue: named(QUEUE), end: named(END), bytes: named(BYTES) };
        let opened = store.with(|database| {
            let transaction = database.begin_read()?;
            let counters = transaction.open_table(COUNTERS)?;
            let counter =
                |name: &str| Ok::<_, redb::Error>(counters.get(name)?.map_or(0, |value| value.value()));
            let end = counter(&lane.end)?;
            let queue = lane.opened(&transaction)?;
            let first = queue.map(|queue| queue.first().map(|first| first.map(|(number, _)| number.value())));
            let first = first.transpose()?.flatten();
            Ok(Opened { waiting: first.unwrap_or(end)..end, bytes: counter(&lane.bytes)? })
        })?;
        Ok((lane, opened))
    }

    fn table(&self) -> TableDefinition<'_, u64, &'static [u8]> {
        TableDefinition::new(&self.queue)
    }

    /// Its table, which is there from the first commit on.
    fn opened(
        &self,
        transaction: &ReadTransaction,
    ) -> Result<Option<redb::ReadOnlyTable<u64, &'static [u8]>>, redb::Error> {
        match transaction.open_table(self.table()) {
            Ok(table) => Ok(Some(table)),
            Err(TableError::TableDoesNotExist(_)) => Ok(None),
            Err(why) => Err(why.into()),
        }
    }

    /// The store it is in.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// The messages with these numbers, as many as there are up to this many. One that cannot be read is left out.
    pub fn read(&self, numbers: Range<u64>, most: usize) -> Result<Vec<(u64, Message)>, String> {
        self.store.with(|database| {
            let Some(queue) = self.opened(&database.begin_read()?)? else { return Ok(Vec::new()) };
            let mut found = Vec::new();
            for entry in queue.range(numbers)?.take(most) {
                let (number, stored) = entry?;
                if let Some(message) = Message::decode(stored.value()) {
                    found.push((number.value(), message));
                }
            }
            Ok(found)
        })
    }

    /// The number of the message up to which (exclusive) this many bytes are freed.
    pub fn number_after(&self, bytes: u64) -> Result<u64, String> {
        self.store.with(|database| {
            let Some(queue) = self.opened(&database.begin_read()?)? else { return Ok(0) };
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
        })
    }
}
