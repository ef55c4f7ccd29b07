//! US Digital T7, blocking.

mod error;
pub(crate) mod question;
mod setting;

use clino_bus::{BusCounters, Duration, Retry, Timing};
use clino_codec::angle::{Angle, Range};
use clino_codec::t7::{
    Acceleration, Address, Axis, DeviceInformation, Direction, Request, Response, Temperature,
};

use crate::Port;
use crate::exchange::Exchanges;
pub use error::Error;
pub(crate) use setting::Setting;

/// The T7s of one line, which this has for itself.
///
/// Addresses are parameters: up to 32 T7s can share a line. One request is on its way at a time; how long an answer may
/// take is in the [`Timing`].
///
/// ```
/// # use clino_drivers::{Port, T7, t7};
/// # use clino_codec::t7::{Address, Axis};
/// fn is_level<P: Port>(t7: &mut T7<P>) -> Result<bool, t7::Error<P::Error>> {
///     let sensor = Address::new(5).expect("1 to 100, or 127");
///     let angle = t7.angle(sensor, Axis::Two)?;
///     Ok(angle.mdeg().abs() < 500)
/// }
/// ```
pub struct T7<P> {
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

impl<P: Port> T7<P> {
    /// A driver for a line with any number of T7s.
    pub fn new(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::new(timing, false) }
    }

    /// A driver for a line with exactly one T7, which may be asked without knowing its address: [`Address::ALL`].
    /// Several T7s would answer at once, and spoil each other's answers.
    pub fn single(port: P, timing: Timing) -> Self {
        Self { port, exchanges: Exchanges::new(timing, true) }
    }

    /// The angle of one axis. A single-axis T7 has axis 2.
    ///
    /// # Errors
    /// [`Error`].
    pub fn angle(&mut self, address: Address, axis: Axis) -> Result<Angle, Error<P::Error>> {
        question::angle(address, self.transact(address, &Request::GetAngle(axis))?)
    }

    /// The angles of all axes, and the temperature.
    ///
    /// # Errors
    /// [`Error`].
    pub fn all_angles(&mut self, address: Address) -> Result<AllAngles, Error<P::Error>> {
        question::all_angles(address, self.transact(address, &Request::GetAllAngles)?)
    }

    /// Angles, temperature, accelerations and serial number.
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

    /// What the device adds to its absolute angles, by axis.
    ///
    /// # Errors
    /// [`Error`].
    pub fn offsets(&mut self, address: Address) -> Result<[Angle; 3], Error<P::Error>> {
        question::offsets(address, self.transact(address, &Request::GetAllAngleOffsets)?)
    }

    /// The counting directions, by axis.
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
    /// again: what was done is not done twice.
    ///
    /// # Errors
    /// [`Error`]; [`Error::Request`] before anything is sent.
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
    /// [`Error`].
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

    /// Asks anything. Set commands go out as they are, without a look at what the device has; their
    /// [`status`](Response::status) is in the answer.
    ///
    /// # Errors
    /// [`Error`].
    pub fn transact(&mut self, address: Address, request: &Request) -> Result<Response, Error<P::Error>> {
        let answer = self.exchanges.ask(&mut self.port, address, request)?;
        Ok(answer.response)
    }

    fn set(&mut self, address: Address, setting: Setting) -> Result<FlashWrite, Error<P::Error>> {
        setting.check(address)?;
        if setting.is_in(address, self.transact(address, &setting.read())?)? {
            return Ok(FlashWrite::Unneeded);
        }
        question::success(address, self.transact(address, &setting.write())?)?;
        setting.was_kept(address, self.transact(address, &setting.read())?)
    }
}

impl<P> T7<P> {
    /// What happened on the line since this was made.
    pub fn counters(&self) -> &BusCounters {
        self.exchanges.master().counters()
    }

    /// The waits in force.
    pub fn timing(&self) -> &Timing {
        self.exchanges.master().timing()
    }

    /// Other waits from the next exchange on, say for another bit rate; the port has to follow.
    pub fn set_timing(&mut self, timing: Timing) {
        self.exchanges.set_timing(timing);
    }

    /// How often to repeat a request that failed, from the next one on; never, unless this says otherwise. What changes
    /// a sensor's non-volatile memory is only repeated if the sensor cannot have heard it.
    pub fn set_retry(&mut self, retry: Retry) {
        self.exchanges.set_retry(retry);
    }

    /// Says that so much time has passed since the last call. The driver has no clock, and counts only what it waits
    /// itself; after a failure, the same request is not sent again while a late answer could be taken for its own
    /// ([`Timing::late`]), and this shortens that. To say too little is safe, to say too much is not.
    pub fn pass(&mut self, span: Duration) {
        self.exchanges.pass(span);
    }

    /// The port.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    /// The port, without the driver.
    pub fn release(self) -> P {
        self.port
    }
}
