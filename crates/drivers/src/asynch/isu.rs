//! STT ISU, async.

use clino_bus::{BusCounters, Duration, Retry, Timing};
use clino_codec::angle::Angle;
use clino_codec::isu::{Address, Data, Request, Response, Words};

#[cfg(feature = "commissioning")]
use clino_commissioning::{Operation, isu as commissioning};

use crate::AsyncPort;
use crate::exchange::Exchanges;
use crate::isu::{Error, question};
#[cfg(feature = "commissioning")]
use crate::run::{AtOneRate, RunError};
use crate::upkeep::upkeep;

/// The ISUs of one line; see [`crate::SttIsu`].
pub struct SttIsu<P> {
    port: P,
    exchanges: Exchanges<clino_bus::Isu>,
}

impl<P: AsyncPort> SttIsu<P> {
    /// As [`crate::SttIsu::new`].
    pub fn new(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, false) }
    }

    /// As [`crate::SttIsu::single`].
    pub fn single(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, true) }
    }

    /// As [`crate::SttIsu::angle`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn angle(&mut self, address: Address) -> Result<Angle, Error<P::Error>> {
        question::angle(self.transact(address, &Request::READ_ANGLE).await?)
    }

    /// As [`crate::SttIsu::read_ram`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_ram(
        &mut self,
        address: Address,
        start: u8,
        count: u8,
    ) -> Result<Data, Error<P::Error>> {
        question::ram(self.transact(address, &Request::ReadRam { start, count }).await?)
    }

    /// As [`crate::SttIsu::read_eeprom`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn read_eeprom(
        &mut self,
        address: Address,
        start: u8,
        count: u8,
    ) -> Result<Words, Error<P::Error>> {
        question::eeprom(self.transact(address, &Request::ReadEeprom { start, count }).await?)
    }

    /// As [`crate::SttIsu::reset_null`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn reset_null(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::ResetNullPosition).await?)
    }

    /// As [`crate::SttIsu::reset`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn reset(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::ResetModule).await?)
    }

    /// As [`crate::SttIsu::go_to_soft_error_state`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn go_to_soft_error_state(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::GoToSoftErrorState).await?)
    }

    /// As [`crate::SttIsu::transact`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn transact(
        &mut self,
        address: Address,
        request: &Request,
    ) -> Result<Response, Error<P::Error>> {
        let answer = self.exchanges.ask_async(&mut self.port, address, request).await?;
        question::accepted(answer.response)
    }

    /// As [`crate::SttIsu::zero`].
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub async fn zero(
        &mut self,
        address: Address,
    ) -> Result<commissioning::Nulled, RunError<commissioning::Failure, P::Error>> {
        let module =
            question::module(address, self.exchanges.is_single()).ok_or(RunError::NotSingleDevice)?;
        self.run(commissioning::ResetNull::new(module)).await
    }

    /// As [`crate::SttIsu::run`].
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub async fn run<O>(&mut self, operation: O) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::Isu> + AtOneRate,
    {
        let timing = *self.timing();
        self.exchanges.run_async(&mut self.port, operation, async |_, _| Ok(timing), |_| ()).await
    }
}

upkeep!(SttIsu);
