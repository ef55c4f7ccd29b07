//! US Digital T7, async.

use clino_bus::{BusCounters, Duration, Retry, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::t7::{Address, Axis, DeviceInformation, Direction, Request, Response};

use crate::AsyncPort;
use crate::exchange::Exchanges;
use crate::t7::{AllAngles, AllData, Error, FlashWrite, Setting, question};

/// The T7s of one line; see [`crate::T7`].
pub struct T7<P> {
    port: P,
    exchanges: Exchanges<clino_bus::T7>,
}

impl<P: AsyncPort> T7<P> {
    /// As [`crate::T7::new`].
    pub fn new(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, false) }
    }

    /// As [`crate::T7::single`].
    pub fn single(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, true) }
    }

    /// As [`crate::T7::angle`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn angle(&mut self, address: Address, axis: Axis) -> Result<Angle, Error<P::Error>> {
        question::angle(address, self.transact(address, &Request::GetAngle(axis)).await?)
    }

    /// As [`crate::T7::all_angles`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn all_angles(&mut self, address: Address) -> Result<AllAngles, Error<P::Error>> {
        question::all_angles(address, self.transact(address, &Request::GetAllAngles).await?)
    }

    /// As [`crate::T7::all_data`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn all_data(&mut self, address: Address) -> Result<AllData, Error<P::Error>> {
        question::all_data(address, self.transact(address, &Request::GetAllData).await?)
    }

    /// As [`crate::T7::information`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn information(&mut self, address: Address) -> Result<DeviceInformation, Error<P::Error>> {
        question::information(address, self.transact(address, &Request::GetDeviceInformation).await?)
    }

    /// As [`crate::T7::offsets`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn offsets(&mut self, address: Address) -> Result<[Angle; 3], Error<P::Error>> {
        question::offsets(address, self.transact(address, &Request::GetAllAngleOffsets).await?)
    }

    /// As [`crate::T7::directions`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn directions(&mut self, address: Address) -> Result<[Direction; 3], Error<P::Error>> {
        question::directions(address, self.transact(address, &Request::GetAllDirections).await?)
    }

    /// As [`crate::T7::damping_ms`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn damping_ms(&mut self, address: Address) -> Result<u16, Error<P::Error>> {
        question::damping_ms(address, self.transact(address, &Request::GetDamping).await?)
    }

    /// As [`crate::T7::range`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn range(&mut self, address: Address) -> Result<Range, Error<P::Error>> {
        question::range(address, self.transact(address, &Request::GetAngleOutputRange).await?)
    }

    /// As [`crate::T7::set_offset`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn set_offset(
        &mut self,
        address: Address,
        axis: Axis,
        offset: Angle,
    ) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Offset(axis, offset.into())).await
    }

    /// As [`crate::T7::set_direction`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn set_direction(
        &mut self,
        address: Address,
        axis: Axis,
        direction: Direction,
    ) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Direction(axis, direction)).await
    }

    /// As [`crate::T7::set_damping_ms`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn set_damping_ms(
        &mut self,
        address: Address,
        damping_ms: u16,
    ) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Damping(damping_ms)).await
    }

    /// As [`crate::T7::set_range`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn set_range(&mut self, address: Address, range: Range) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Range(range)).await
    }

    /// As [`crate::T7::transact`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn transact(
        &mut self,
        address: Address,
        request: &Request,
    ) -> Result<Response, Error<P::Error>> {
        let answer = self.exchanges.ask_async(&mut self.port, address, request).await?;
        Ok(answer.response)
    }

    async fn set(&mut self, address: Address, setting: Setting) -> Result<FlashWrite, Error<P::Error>> {
        setting.check(address)?;
        if setting.is_in(address, self.transact(address, &setting.read()).await?)? {
            return Ok(FlashWrite::Unneeded);
        }
        question::success(address, self.transact(address, &setting.write()).await?)?;
        setting.was_kept(address, self.transact(address, &setting.read()).await?)
    }
}

impl<P> T7<P> {
    /// As [`crate::T7::counters`].
    pub fn counters(&self) -> &BusCounters {
        self.exchanges.master().counters()
    }

    /// As [`crate::T7::timing`].
    pub fn timing(&self) -> &Timing {
        self.exchanges.master().timing()
    }

    /// As [`crate::T7::set_timing`].
    pub fn set_timing(&mut self, timing: Timing) {
        self.exchanges.set_timing(timing);
    }

    /// As [`crate::T7::set_retry`].
    pub fn set_retry(&mut self, retry: Retry) {
        self.exchanges.set_retry(retry);
    }

    /// As [`crate::T7::pass`].
    pub fn pass(&mut self, span: Duration) {
        self.exchanges.pass(span);
    }

    /// As [`crate::T7::port`].
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    /// As [`crate::T7::release`].
    pub fn release(self) -> P {
        self.port
    }
}
