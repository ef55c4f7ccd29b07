//! STT ISU, async.

use clino_bus::{BusCounters, Duration, Retry, Timing};
use clino_codec::angle::Angle;
use clino_codec::isu::{Address, Data, Request, Response, Words};

use crate::AsyncPort;
use crate::exchange::Exchanges;
use crate::isu::{Error, question};

/// The ISUs of one line; see [`crate::Isu`].
pub struct Isu<P> {
    port: P,
    exchanges: Exchanges<clino_bus::Isu>,
}

impl<P: AsyncPort> Isu<P> {
    /// As [`crate::Isu::new`].
    pub fn new(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, false) }
    }

    /// As [`crate::Isu::single`].
    pub fn single(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, true) }
    }

    /// As [`crate::Isu::angle`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn angle(&mut self, address: Address) -> Result<Angle, Error<P::Error>> {
        question::angle(self.transact(address, &Request::READ_ANGLE).await?)
    }

    /// As [`crate::Isu::read_ram`].
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

    /// As [`crate::Isu::read_eeprom`].
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

    /// As [`crate::Isu::reset_null`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn reset_null(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::ResetNullPosition).await?)
    }

    /// As [`crate::Isu::reset`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn reset(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::ResetModule).await?)
    }

    /// As [`crate::Isu::go_to_soft_error_state`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn go_to_soft_error_state(&mut self, address: Address) -> Result<(), Error<P::Error>> {
        question::done(self.transact(address, &Request::GoToSoftErrorState).await?)
    }

    /// As [`crate::Isu::transact`].
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
}

impl<P> Isu<P> {
    /// As [`crate::Isu::counters`].
    pub fn counters(&self) -> &BusCounters {
        self.exchanges.master().counters()
    }

    /// As [`crate::Isu::timing`].
    pub fn timing(&self) -> &Timing {
        self.exchanges.master().timing()
    }

    /// As [`crate::Isu::set_timing`].
    pub fn set_timing(&mut self, timing: Timing) {
        self.exchanges.set_timing(timing);
    }

    /// As [`crate::Isu::set_retry`].
    pub fn set_retry(&mut self, retry: Retry) {
        self.exchanges.set_retry(retry);
    }

    /// As [`crate::Isu::pass`].
    pub fn pass(&mut self, span: Duration) {
        self.exchanges.pass(span);
    }

    /// As [`crate::Isu::port`].
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    /// As [`crate::Isu::release`].
    pub fn release(self) -> P {
        self.port
    }
}
