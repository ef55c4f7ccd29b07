//! US Digital T7, blocking.

mod error;
pub(crate) mod question;
mod setting;

#[cfg(feature = "commissioning")]
use clino_bus::Serial;
use clino_bus::{BusCounters, Duration, Retry, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::t7::{
    Acceleration, Address, Axis, DeviceInformation, Direction, Request, Response, Temperature,
};
#[cfg(feature = "commissioning")]
use clino_commissioning::{Operation, t7 as commissioning};

use crate::Port;
use crate::exchange::Exchanges;
#[cfg(feature = "commissioning")]
use crate::run::{AtOneRate, RunError};
use crate::upkeep::upkeep;
pub use error::Error;
pub(crate) use setting::Setting;

/// The T7s of one line, which this has for itself.
///
/// Addresses are parameters: up to 32 T7s can share a line. One request is on its way at a time; how long an answer may
/// take is in the [`Timing`].
///
/// ```
/// # use clino_drivers::{Port, UsDigitalT7, t7};
/// # use clino_codec::t7::{Address, Axis};
/// fn is_level<P: Port>(t7: &mut UsDigitalT7<P>) -> Result<bool, t7::Error<P::Error>> {
///     let sensor = Address::new(5).expect("1 to 100, or 127");
///     let angle = t7.angle(sensor, Axis::Two)?;
///     Ok(angle.mdeg().abs() < 500)
/// }
/// ```
pub struct UsDigitalT7<P> {
    port: P,
    exchanges: Exchanges<clino_bus::T7>,
}

/// All angles of a device at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AllAngles {
    /// By axis; those that a single-axis T7 does not have (0 and 1) read zero.
    pub angles: [Angle; 3],
    /// Of the device.
    pub temperature: Temperature,
}

/// All that a device measures at one time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AllData {
    /// By axis; those that a single-axis T7 does not have (0 and 1) read zero.
    pub angles: [Angle; 3],
    /// Of the device.
    pub temperature: Temperature,
    /// By axis.
    pub accelerations: [Acceleration; 3],
    /// Serial number.
    pub serial: u32,
}

/// What it took to set something that non-volatile memory keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FlashWrite {
    /// Nothing: the device had that value. Flash was not written.
    Unneeded,
    /// It was written, and read back.
    Written,
}

impl<P: Port> UsDigitalT7<P> {
    /// A driver for a line with any number of T7s.
    pub fn new(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::new(timing, false) }
    }

    /// A driver for a line with exactly one T7, which may be asked without knowing its address: [`Address::ALL`].
    /// Several T7s would answer at once, and spoil each other's answers.
    pub fn single(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::new(timing, true) }
    }

    /// The angle of one axis; axis 2 for a single-axis T7, which answers zero for the axes that it does not have.
    ///
    /// So an axis 0 or 1 that reads exactly zero is not believed before the device has said what it is: one exchange more,
    /// which [`Address::ALL`] does not allow.
    ///
    /// # Errors
    /// [`Error`]; [`Error::NoSuchAxis`] instead of the zero of a single-axis T7; [`Error::Request`] instead of such a zero
    /// from [`Address::ALL`].
    pub fn angle(&mut self, address: Address, axis: Axis) -> Result<Angle, Error<P::Error>> {
        let angle = question::angle(address, self.transact(address, &Request::GetAngle(axis))?)?;
        if question::is_doubtful(axis, angle) {
            question::has_axis(axis, &self.information(address)?)?;
        }
        Ok(angle)
    }

    /// The angles of all axes, and the temperature; zero for the axes that a single-axis T7 does not have.
    ///
    /// # Errors
    /// [`Error`].
    pub fn all_angles(&mut self, address: Address) -> Result<AllAngles, Error<P::Error>> {
        question::all_angles(address, self.transact(address, &Request::GetAllAngles)?)
    }

    /// Angles (zero for the axes that a single-axis T7 does not have), temperature, accelerations and serial number.
    ///
    /// # Errors
    /// [`Error`].
    pub fn all_data(&mut self, address: Address) -> Result<AllData, Error<P::Error>> {
        question::all_data(address, self.transact(address, &Request::GetAllData)?)
    }

    /// Serial number, firmware version, product type.
    ///
    /// # Errors
    /// [`Error`].
    pub fn information(&mut self, address: Address) -> Result<DeviceInformation, Error<P::Error>> {
        question::information(address, self.transact(address, &Request::GetDeviceInformation)?)
    }

    /// What the device adds to its absolute angles, by axis; zero for the axes that a single-axis T7 does not have.
    ///
    /// # Errors
    /// [`Error`].
    pub fn offsets(&mut self, address: Address) -> Result<[Angle; 3], Error<P::Error>> {
        question::offsets(address, self.transact(address, &Request::GetAllAngleOffsets)?)
    }

    /// The counting directions, by axis; normal for the axes that a single-axis T7 does not have.
    ///
    /// # Errors
    /// [`Error`].
    pub fn directions(&mut self, address: Address) -> Result<[Direction; 3], Error<P::Error>> {
        question::directions(address, self.transact(address, &Request::GetAllDirections)?)
    }

    /// The damping time in milliseconds.
    ///
    /// # Errors
    /// [`Error`].
    pub fn damping_ms(&mut self, address: Address) -> Result<u16, Error<P::Error>> {
        question::damping_ms(address, self.transact(address, &Request::GetDamping)?)
    }

    /// How the device counts a turn.
    ///
    /// # Errors
    /// [`Error`].
    pub fn range(&mut self, address: Address) -> Result<Range, Error<P::Error>> {
        question::range(address, self.transact(address, &Request::GetAngleOutputRange)?)
    }

    /// Sets what the device adds to the absolute angle of an axis, to the nearest millidegree; −180.000…359.999°, which
    /// the device narrows to its output range. Whole turns make no difference, and are not written.
    ///
    /// As all `set_…`: reads, compares, writes only a difference, reads back. When this fails half-way, call it
    /// again: what was done is not done twice. Before an axis 0 or 1 the device says what it is.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Request`] before anything is sent; [`Error::NoSuchAxis`] before anything is written.
    pub fn set_offset(
        &mut self,
        address: Address,
        axis: Axis,
        offset: Angle,
    ) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Offset(axis, offset.into()))
    }

    /// Sets the counting direction of an axis, as [`set_offset`](Self::set_offset).
    ///
    /// # Errors
    /// [`Error`]; [`Error::NoSuchAxis`] before anything is written.
    pub fn set_direction(
        &mut self,
        address: Address,
        axis: Axis,
        direction: Direction,
    ) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Direction(axis, direction))
    }

    /// Sets the damping time, 2…5000 ms, as [`set_offset`](Self::set_offset).
    ///
    /// # Errors
    /// [`Error`]; [`Error::Request`] before anything is sent.
    pub fn set_damping_ms(
        &mut self,
        address: Address,
        damping_ms: u16,
    ) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Damping(damping_ms))
    }

    /// Sets how the device counts a turn, as [`set_offset`](Self::set_offset).
    ///
    /// # Errors
    /// [`Error`].
    pub fn set_range(&mut self, address: Address, range: Range) -> Result<FlashWrite, Error<P::Error>> {
        self.set(address, Setting::Range(range))
    }

    /// Asks anything. Set commands go out as they are, without a look at what the device has; answers come as they are, the
    /// zeros of axes that a single-axis T7 does not have among them.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Refused`] when the device says that it did not carry out the command.
    pub fn transact(&mut self, address: Address, request: &Request) -> Result<Response, Error<P::Error>> {
        let answer = self.exchanges.ask(&mut self.port, address, request)?;
        question::accepted(answer.response)
    }

    /// Makes an axis read zero from now on: waits until the damping has settled, refuses while it moves, writes, reads back.
    ///
    /// It takes the damping time and a quarter of a second, and writes flash unless the axis reads zero already. An axis
    /// that a single-axis T7 does not have is refused, though it reads zero.
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub fn zero(
        &mut self,
        address: Address,
        axis: Axis,
    ) -> Result<commissioning::Zeroed, RunError<commissioning::Failure, P::Error>> {
        self.run(commissioning::SetZero::new(self.device(address).ok_or(RunError::NotSingleDevice)?, axis))
    }

    /// Runs an [operation](crate::run) of `clino-commissioning` to its end.
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub fn run<O>(&mut self, operation: O) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::T7> + AtOneRate,
    {
        self.run_telling(operation, |_| ())
    }

    /// As [`run`](Self::run); `tell` takes what the operation reports before its end.
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub fn run_telling<O>(
        &mut self,
        operation: O,
        tell: impl FnMut(O::Event),
    ) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::T7> + AtOneRate,
    {
        let timing = *self.timing();
        self.exchanges.run(&mut self.port, operation, |_, _| Ok(timing), tell)
    }

    /// As [`run_telling`](Self::run_telling), for an operation that changes the bit rate of the line: `rate` sets it, in
    /// the UART and in the [`PortSettings`](crate::rs485::PortSettings), and returns the waits for it, such as
    /// [`Timing::t7`].
    ///
    /// # Errors
    /// [`RunError`].
    #[cfg(feature = "commissioning")]
    pub fn run_at_rates<O>(
        &mut self,
        operation: O,
        rate: impl FnMut(&mut P, Serial) -> Result<Timing, P::Error>,
        tell: impl FnMut(O::Event),
    ) -> Result<O::Report, RunError<O::Error, P::Error>>
    where
        O: Operation<Protocol = clino_bus::T7>,
    {
        self.exchanges.run(&mut self.port, operation, rate, tell)
    }

    #[cfg(feature = "commissioning")]
    fn device(&self, address: Address) -> Option<commissioning::Device> {
        question::device(address, self.exchanges.is_single())
    }

    fn set(&mut self, address: Address, setting: Setting) -> Result<FlashWrite, Error<P::Error>> {
        setting.check(address)?;
        if let Some(axis) = setting.axis_in_question() {
            question::has_axis(axis, &self.information(address)?)?;
        }
        if setting.is_in(address, self.transact(address, &setting.read())?)? {
            return Ok(FlashWrite::Unneeded);
        }
        self.transact(address, &setting.write())?;
        setting.was_kept(address, self.transact(address, &setting.read())?)
    }
}

upkeep!(UsDigitalT7);
