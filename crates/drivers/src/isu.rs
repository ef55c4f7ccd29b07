//! STT ISU, blocking.

mod error;
pub(crate) mod question;

use clino_bus::{BusCounters, Duration, Retry, Timing};
use clino_codec::angle::Angle;
use clino_codec::isu::{Address, Data, Request, Response, Words};
#[cfg(feature = "commissioning")]
use clino_commissioning::{Operation, isu as commissioning};

use crate::Port;
use crate::exchange::Exchanges;
#[cfg(feature = "commissioning")]
use crate::run::{AtOneRate, RunError};
use crate::upkeep::upkeep;
pub use error::Error;

/// The ISUs of one line, which this has for itself.
///
/// Addresses are parameters: up to 14 ISUs can share a line. An ISU has a new angle every 8/15 s: asked more often, it
/// repeats itself.
///
/// Changing what the EEPROM keeps takes more than a command: a plan, a checksum, a reset. [`run`](Self::run) carries out the
/// operations that do that.
///
/// ```
/// # use clino_drivers::{Port, SttIsu, isu};
/// # use clino_codec::isu::Address;
/// fn is_level<P: Port>(isu: &mut SttIsu<P>) -> Result<bool, isu::Error<P::Error>> {
///     let module = Address::new(3).expect("1 to 14");
///     let angle = isu.angle(module)?;
///     Ok(angle.mdeg() < 500 || angle.mdeg() > 359_500)
/// }
/// ```
pub struct SttIsu<P> {
    port: P,
    exchanges: Exchanges<clino_bus::Isu>,
}

impl<P: Port> SttIsu<P> {
    /// A driver for a line with any number of ISUs.
    pub fn new(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::new(timing, false) }
    }

    /// A driver for a line with exactly one ISU, which may be asked without knowing its address: [`Address::ANY`].
    /// Several ISUs would answer at once, and spoil each other's answers.
    pub fn single(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::new(timing, true) }
    }

    /// The angle from the null position, clockwise, 0…359.99°.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Refused`] by a module in its Hard Error state.
    pub fn angle(&mut self, address: Address) -> Result<Angle, Error<P::Error>> {
        question::angle(self.transact(address, &Request::READ_ANGLE)?)
    }

    /// Bytes of RAM: `count` (at least one, at most [`MAX_DATA`](clino_codec::isu::MAX_DATA)) from `start` on.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Request`] before anything is sent.
    pub fn read_ram(&mut self, address: Address, start: u8, count: u8) -> Result<Data, Error<P::Error>> {
        question::ram(self.transact(address, &Request::ReadRam { start, count })?)
    }

    /// Words of EEPROM: `count` (at least one, at most [`MAX_WORDS`](clino_codec::isu::MAX_WORDS)) from `start` on.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Request`] before anything is sent.
    pub fn read_eeprom(&mut self, address: Address, start: u8, count: u8) -> Result<Words, Error<P::Error>> {
        question::eeprom(self.transact(address, &Request::ReadEeprom { start, count })?)
    }

    /// The present angle becomes zero, which [`angle`](Self::angle) shows after up to 533 ms: until its next measurement
    /// the module repeats the last one. `zero` waits for that and checks it.
    ///
    /// The module keeps the null position in its EEPROM, which wears.
    ///
    /// # Errors
    /// [`Error`]. After [`Error::NoAnswer`] or a bad answer it may have been done: read the angle.
    pub fn reset_null(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::ResetNullPosition)?)
    }

    /// As if power had been cycled; the module does not answer until it has started, for which the document has no time.
    /// The operation [`Reset`](clino_commissioning::isu::Reset) waits for it.
    ///
    /// # Errors
    /// [`Error`].
    pub fn reset(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::ResetModule)?)
    }

    /// Out of the Hard Error state, so that the module answers again; it does not measure.
    ///
    /// # Errors
    /// [`Error`].
    pub fn go_to_soft_error_state(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::GoToSoftErrorState)?)
    }

    /// Asks anything. Writes to EEPROM go out as they are, if they stay within what the document names: without
    /// the right checksum the module does not measure after its next reset.
    ///
    /// # Errors
    /// [`Error`].
    pub fn transact(&mut self, address: Address, request: &Request) -> Result<Response, Error<P::Error>> {
        let answer = self.exchanges.ask(&mut self.port, address, request)?;
        question::accepted(answer.response)
    }

    /// Makes the module read zero from now on: refuses while it moves, writes, waits for the next measurement, reads back.
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub fn zero(
        &mut self,
        address: Address,
    ) -> Result<commissioning::Nulled, RunError<commissioning::Failure, P::Error>> {
        self.run(commissioning::ResetNull::new(self.module(address).ok_or(RunError::NotSingleDevice)?))
    }

    /// Runs an [operation](crate::run) of `clino-commissioning` to its end.
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub fn run<O>(&mut self, operation: O) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::Isu> + AtOneRate,
    {
        let timing = *self.timing();
        self.exchanges.run(&mut self.port, operation, |_, _| Ok(timing), |_| ())
    }

    #[cfg(feature = "commissioning")]
    fn module(&self, address: Address) -> Option<commissioning::Module> {
        question::module(address, self.exchanges.is_single())
    }
}

upkeep!(SttIsu);
