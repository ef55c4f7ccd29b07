//! US Digital T7, async.

use clino_bus::{BusCounters, Duration, Retry, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::t7::{Address, Axis, DeviceInformation, Direction, Request, Response};

#[cfg(feature = "commissioning")]
use clino_bus::Serial;
#[cfg(feature = "commissioning")]
use clino_commissioning::{Operation, t7 as commissioning};

use crate::AsyncPort;
use crate::exchange::Exchanges;
#[cfg(feature = "commissioning")]
use crate::run::{AtOneRate, RunError};
use crate::t7::{AllAngles, AllData, Error, FlashWrite, Setting, question};
use crate::upkeep::upkeep;

/// The T7s of one line; see [`crate::UsDigitalT7`].
pub struct UsDigitalT7<P> {
    port: P,
    exchanges: Exchanges<clino_bus::T7>,
}

impl<P: AsyncPort> UsDigitalT7<P> {
    /// As [`crate::UsDigitalT7::new`].
    pub fn new(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, false) }
    }

    /// As [`crate::UsDigitalT7::single`].
    pub fn single(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::in_pieces(timing, true) }
    }

    /// As [`crate::UsDigitalT7::angle`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn angle(&mut self, address: Address, axis: Axis) -> Result<Angle, Error<P::Error>> {
        let angle = question::angle(address, self.transact(address, &Request::GetAngle(axis)).await?)?;
        if question::is_doubtful(axis, angle) {
            question::has_axis(axis, &self.information(address).await?)?;
        }
        Ok(angle)
    }

    /// As [`crate::UsDigitalT7::all_angles`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn all_angles(&mut self, address: Address) -> Result<AllAngles, Error<P::Error>> {
        question::all_angles(address, self.transact(address, &Request::GetAllAngles).await?)
    }

    /// As [`crate::UsDigitalT7::all_data`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn all_data(&mut self, address: Address) -> Result<AllData, Error<P::Error>> {
        question::all_data(address, self.transact(address, &Request::GetAllData).await?)
    }

    /// As [`crate::UsDigitalT7::information`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn information(&mut self, address: Address) -> Result<DeviceInformation, Error<P::Error>> {
        question::information(address, self.transact(address, &Request::GetDeviceInformation).await?)
    }

    /// As [`crate::UsDigitalT7::offsets`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn offsets(&mut self, address: Address) -> Result<[Angle; 3], Error<P::Error>> {
        question::offsets(address, self.transact(address, &Request::GetAllAngleOffsets).await?)
    }

    /// As [`crate::UsDigitalT7::directions`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn directions(&mut self, address: Address) -> Result<[Direction; 3], Error<P::Error>> {
        question::directions(address, self.transact(address, &Request::GetAllDirections).await?)
    }

    /// As [`crate::UsDigitalT7::damping_ms`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn damping_ms(&mut self, address: Address) -> Result<u16, Error<P::Error>> {
        question::damping_ms(address, self.transact(address, &Request::GetDamping).await?)
    }

    /// As [`crate::UsDigitalT7::range`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn range(&mut self, address: Address) -> Result<Range, Error<P::Error>> {
        question::range(address, self.transact(address, &Request::GetAngleOutputRange).await?)
    }

    /// As [`crate::UsDigitalT7::set_offset`].
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

    /// As [`crate::UsDigitalT7::set_direction`].
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

    /// As [`crate::UsDigitalT7::set_damping_ms`].
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

    /// As [`crate::UsDigitalT7::set_range`].
    ///
    /// # Errors
    /// [`Error`].
    pub async fn set_range(&mut self, address: Address, range: Range) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Range(range)).await
    }

    /// As [`crate::UsDigitalT7::transact`].
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

    /// As [`crate::UsDigitalT7::zero`].
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub async fn zero(
        &mut self,
        address: Address,
        axis: Axis,
    ) -> Result<commissioning::Zeroed, RunError<commissioning::Failure, P::Error>> {
        let device =
            question::device(address, self.exchanges.is_single()).ok_or(RunError::NotSingleDevice)?;
        self.run(commissioning::SetZero::new(device, axis)).await
    }

    /// As [`crate::UsDigitalT7::run`].
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub async fn run<O>(&mut self, operation: O) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::T7> + AtOneRate,
    {
        self.run_telling(operation, |_| ()).await
    }

    /// As [`crate::UsDigitalT7::run_telling`].
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub async fn run_telling<O>(
        &mut self,
        operation: O,
        tell: impl FnMut(O::Event),
    ) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::T7> + AtOneRate,
    {
        let timing = *self.timing();
        self.exchanges.run_async(&mut self.port, operation, async |_, _| Ok(timing), tell).await
    }

    /// As [`crate::UsDigitalT7::run_at_rates`].
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub async fn run_at_rates<O>(
        &mut self,
        operation: O,
        rate: impl AsyncFnMut(&mut P, Serial) -> Result<Timing, P::Error>,
        tell: impl FnMut(O::Event),
    ) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::T7>,
    {
        self.exchanges.run_async(&mut self.port, operation, rate, tell).await
    }

    async fn set(&mut self, address: Address, setting: Setting) -> Result<FlashWrite, Error<P::Error>> {
        setting.check(address)?;
        if let Some(axis) = setting.axis_in_question() {
            question::has_axis(axis, &self.information(address).await?)?;
        }
        if setting.is_in(address, self.transact(address, &setting.read()).await?)? {
            return Ok(FlashWrite::Unneeded);
        }
        self.transact(address, &setting.write()).await?;
        setting.was_kept(address, self.transact(address, &setting.read()).await?)
    }
}

upkeep!(UsDigitalT7);
