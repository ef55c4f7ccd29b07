//! Operations of `clino-commissioning` on a driver's line: find, set up and repair sensors.
//!
//! ```
//! # use clino_drivers::{Port, UsDigitalT7, run::RunError};
//! # use clino_codec::t7::Address;
//! use clino_drivers::commissioning::t7::{ChangeAddress, Failure};
//!
//! /// A T7 fresh from the factory becomes number 5.
//! fn number_five<P: Port>(t7: &mut UsDigitalT7<P>) -> Result<(), RunError<Failure, P::Error>> {
//!     let five = Address::new(5).expect("1 to 100, or 127");
//!     let operation = ChangeAddress::new(Address::FACTORY, five).expect("five can be given");
//!     t7.run(operation).map(|_report| ())
//! }
//! ```
//!
//! Between its exchanges an operation waits with the port: no other request can be sent meanwhile. A gateway that polls
//! beside it uses the operation's own runner, [`clino_commissioning::Runner`].
//!
//! A future that is dropped ends the operation where it is, like a power cut: what is half-written is found and put right
//! when the operation runs again; an ISU's EEPROM by [`Repair`](clino_commissioning::isu::Repair).

use core::fmt;

use clino_commissioning::{isu, t7};

/// Why an operation was not carried out. `F` is the operation's failure, `E` the port's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RunError<F, E> {
    /// The address of all sensors, on a line that may have several. Nothing was sent.
    NotSingleDevice,
    /// The operation has ended without a result: none of `clino-commissioning` does.
    NoResult,
    /// The operation failed.
    Failed(F),
    /// The port failed, and the operation with it: first the port.
    Port {
        /// What the port failed with first.
        error: E,
        /// What became of the operation.
        failure: F,
    },
}

impl<F: fmt::Display, E: fmt::Display> fmt::Display for RunError<F, E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotSingleDevice => write!(
                f,
                "not sent: all sensors of the line have this address; make the driver with `single` if there is one"
            ),
            Self::NoResult => write!(f, "the operation has ended without a result"),
            Self::Failed(failure) => write!(f, "{failure}"),
            Self::Port { error, failure } => write!(f, "{failure}; the port: {error}"),
        }
    }
}

impl<F, E> core::error::Error for RunError<F, E>
where
    F: core::error::Error + 'static,
    E: core::error::Error + 'static,
{
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::NotSingleDevice | Self::NoResult => None,
            Self::Failed(failure) => Some(failure),
            Self::Port { error, .. } => Some(error),
        }
    }
}

/// An operation that leaves the bit rate of the line as it is: `run` takes it. [`t7::Sweep`] and [`t7::ChangeBaud`] do
/// not, and need `run_at_rates`:
///
/// ```compile_fail
/// # use clino_drivers::{Port, UsDigitalT7, commissioning::t7::ChangeBaud};
/// fn lost_on_the_way<P: Port>(t7: &mut UsDigitalT7<P>, change: ChangeBaud) {
///     let _ = t7.run(change);
/// }
/// ```
pub trait AtOneRate {}

impl AtOneRate for t7::Identify {}
impl AtOneRate for t7::Set {}
impl AtOneRate for t7::SetZero {}
impl AtOneRate for t7::ChangeAddress {}
impl AtOneRate for t7::AskAll {}
impl AtOneRate for isu::Identify {}
impl AtOneRate for isu::ReadAngle {}
impl AtOneRate for isu::GoToSoftError {}
impl AtOneRate for isu::Reset {}
impl AtOneRate for isu::ResetNull {}
impl AtOneRate for isu::Program {}
impl AtOneRate for isu::Repair {}
