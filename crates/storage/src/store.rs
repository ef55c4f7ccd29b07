//! Load, save, factory reset.

use clino_gateway::Configuration;
use sequential_storage::cache::key_pointers::ArrayKeyPointers;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage, SerializationError, Value};

use crate::pages::{FlashError, PAGES, Pages, Sectors};
use crate::record::{self, Compare, Content, Fill, Kind, LONGEST, Part, Reject};
use crate::wait;

/// The library remembers where the newest item is. Without that it would look for it again for every item of a sector that
/// is to be erased: a tenth of a second, for the longest.
type WhereItIs = Cache<Uncached, Uncached, ArrayKeyPointers<(), 1>, ()>;
/// At how many places a record is tried. Each attempt costs its words again: 8 ms for the longest.
const PLACES: u8 = 8;

/// One item, therefore no key.
type Map<'f> = MapStorage<(), Pages<'f>, WhereItIs>;
type LibraryError = sequential_storage::Error<FlashError>;

/// What [`Store::load`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loaded {
    /// A configuration, stored as this version of the record.
    Stored {
        /// Older than [`record::VERSION`]: it was migrated.
        version: u8,
    },
    /// The factory's settings were asked for and nothing was saved since.
    Factory,
    /// Nothing was ever saved.
    Nothing,
}

/// What [`Store::save`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveOutcome {
    /// Nothing: the same was stored already.
    Unchanged,
    /// It is stored now.
    Written,
}

/// Why nothing was loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadError {
    /// What is stored is not taken.
    Rejected(Reject),
    /// The flash cannot be read.
    Flash(FlashError),
    /// The library does not find its way in what is stored.
    Library,
}

/// Why nothing was saved. The last configuration is still there, if there was one that could be loaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// The gateway could not run like this.
    Rejected(Reject),
    /// The flash did not do what it was ordered to do.
    Flash(FlashError),
    /// The library does not find its way in what is stored.
    Library,
}

/// The configuration in three sectors of flash. See the crate's documentation.
pub struct Store<'f> {
    map: Map<'f>,
    /// The record that was read or is to be written.
    buffer: [u8; LONGEST],
    saves: u32,
}

impl<'f> Store<'f> {
    /// In this flash, any `NorFlash` whose offsets begin with the first of the sectors. Nothing is read yet.
    pub fn new(flash: &'f mut dyn Sectors) -> Store<'f> {
        let where_it_is = Cache::new(Uncached, Uncached, ArrayKeyPointers::new());
        let map = MapStorage::new(Pages::new(flash), const { MapConfig::new(0..PAGES) }, where_it_is);
        Store { map, buffer: [0; LONGEST], saves: 0 }
    }

    /// Takes over what is stored. Nothing is changed unless it is a configuration, and then everything is. The flash is
    /// only read.
    ///
    /// # Errors
    /// [`LoadError`]; nothing has changed then.
    pub fn load(
        &mut self,
        place: &mut dyn Configuration,
        modbus: &mut clino_modbus::Settings,
    ) -> Result<Loaded, LoadError> {
        let Some(record) = self.stored().map_err(LoadError::from)? else { return Ok(Loaded::Nothing) };
        // Once without taking it: a record that is wrong at its end must leave no beginning behind.
        match record::decode(record, &mut |_| ()).map_err(LoadError::Rejected)? {
            Kind::Factory => Ok(Loaded::Factory),
            Kind::Configuration(version) => {
                record::decode(record, &mut |part| apply(part, place, modbus))
                    .map_err(LoadError::Rejected)?;
                Ok(Loaded::Stored { version })
            }
        }
    }

    /// Stores this configuration, unless it is stored already. Stalls the core for up to half a second when a sector is
    /// full. What cannot be loaded and is in the way is given up. Words that are not free where they should be are left
    /// behind, at up to eight places.
    ///
    /// # Errors
    /// [`SaveError`]; the last configuration is still there then, if it could be loaded.
    pub fn save(
        &mut self,
        configuration: &dyn Configuration,
        modbus: &clino_modbus::Settings,
    ) -> Result<SaveOutcome, SaveError> {
        record::check(configuration, modbus).map_err(SaveError::Rejected)?;
        self.put(Content::Configuration(configuration, modbus))
    }

    /// From now on [`Store::load`] finds [`Loaded::Factory`], as safe from power cuts as a configuration. If that cannot be
    /// stored behind what is there, all of it is given up.
    ///
    /// # Errors
    /// [`SaveError::Flash`]; the last configuration may be lost then, as it was to be.
    pub fn factory_reset(&mut self) -> Result<SaveOutcome, SaveError> {
        self.put(Content::Factory).or_else(|_| {
            self.clear()?;
            self.put(Content::Factory)
        })
    }

    /// Whether nothing was ever stored. Nothing of a record is read, so that no record can do harm.
    pub fn is_blank(&mut self) -> bool {
        self.map.flash().is_blank().unwrap_or(false)
    }

    /// Records written since start.
    pub const fn saves(&self) -> u32 {
        self.saves
    }

    /// Sectors erased since start.
    pub const fn erases(&mut self) -> u32 {
        self.map.flash().erases()
    }

    /// The newest whole record.
    fn stored(&mut self) -> Result<Option<&[u8]>, Failure> {
        match wait::now(self.map.fetch_item::<&[u8]>(&mut self.buffer, &())) {
            Some(Ok(record)) => Ok(record),
            Some(Err(error)) => Err(error.into()),
            None => Err(Failure::Library),
        }
    }

    fn put(&mut self, content: Content<'_>) -> Result<SaveOutcome, SaveError> {
        let is_readable = match self.stored() {
            Ok(Some(stored)) => {
                let mut compare = Compare::new(stored);
                record::encode(content, &mut compare);
                if compare.same() {
                    return Ok(SaveOutcome::Unchanged);
                }
                true
            }
            Ok(None) => false,
            // The content is useless, and would hide what is written behind it.
            Err(Failure::Library) => {
                self.clear()?;
                false
            }
            Err(failure) => return Err(failure.into()),
        };
        match self.append(content) {
            Err(Failure::Library) if !is_readable => {
                self.clear()?;
                self.append(content)?;
            }
            result => result?,
        }
        self.saves = self.saves.saturating_add(1);
        Ok(SaveOutcome::Written)
    }

    /// Writes a record behind what is there, and behind words that have changed where nothing should be.
    fn append(&mut self, content: Content<'_>) -> Result<(), Failure> {
        for _ in 1..PLACES {
            match self.append_once(content) {
                // What was written so far is skipped by the next attempt.
                Err(Failure::Flash(FlashError::Verify { .. })) => {}
                result => return result,
            }
        }
        self.append_once(content)
    }

    fn append_once(&mut self, content: Content<'_>) -> Result<(), Failure> {
        wait::now(self.map.store_item(&mut self.buffer, &(), &content))
            .unwrap_or(Err(LibraryError::LogicBug {}))
            .map_err(Failure::from)
    }

    /// Gives up all that is there.
    fn clear(&mut self) -> Result<(), Failure> {
        wait::now(self.map.erase_all()).unwrap_or(Err(LibraryError::LogicBug {})).map_err(Failure::from)
    }
}

fn apply(part: Part<'_>, place: &mut dyn Configuration, modbus: &mut clino_modbus::Settings) {
    match part {
        Part::Bus(bus, settings) => place.set_bus(bus, settings),
        Part::Modbus(port) => *modbus = port,
        Part::Console(console) => place.set_console(&console),
        Part::Slot(slot, config) => place.set_slot(slot.into(), config),
    }
}

impl Value<'_> for Content<'_> {
    fn serialize_into(&self, buffer: &mut [u8]) -> Result<usize, SerializationError> {
        let room = buffer.len();
        let mut fill = Fill::new(buffer);
        record::encode(*self, &mut fill);
        let left = fill.left().ok_or(SerializationError::BufferTooSmall)?;
        Ok(room.saturating_sub(left))
    }

    /// Never called: the store reads bytes.
    fn deserialize_from(_: &[u8]) -> Result<(Self, usize), SerializationError> {
        Err(SerializationError::InvalidFormat)
    }
}

/// What both directions have in common.
enum Failure {
    Flash(FlashError),
    Library,
}

impl From<LibraryError> for Failure {
    fn from(error: LibraryError) -> Failure {
        match error {
            sequential_storage::Error::Storage { value, .. } => Failure::Flash(value),
            _ => Failure::Library,
        }
    }
}

impl From<Failure> for LoadError {
    fn from(failure: Failure) -> LoadError {
        match failure {
            Failure::Flash(error) => LoadError::Flash(error),
            Failure::Library => LoadError::Library,
        }
    }
}

impl From<Failure> for SaveError {
    fn from(failure: Failure) -> SaveError {
        match failure {
            Failure::Flash(error) => SaveError::Flash(error),
            Failure::Library => SaveError::Library,
        }
    }
}
