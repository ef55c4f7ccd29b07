//! The probable cause of an exchange that failed, and the next step.
//!
//! An error says what was seen; this says what it suggests, together with everything seen on the line since the driver was
//! made. It is a guess, and no behaviour depends on it.

use core::fmt;

/// What to suspect. Its text names the cause and the next step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Suspect {
    /// No sensor has answered yet. Where others have tried everything else, the line driver goes off before the frame is
    /// out: see [`Release`](crate::rs485::Release).
    NeverAnswered,
    /// Other requests were answered: it is about this sensor.
    Silent,
    /// Exactly our own frame came back, and nothing else: the receiver is on while we send, and the sensor is silent.
    OwnEcho,
    /// Answers come after their deadline.
    LateAnswers,
    /// Most characters have no stop bit: something sends at another bit rate.
    BitRate,
    /// The line is low for whole characters: it is upside down, or something sends at a lower bit rate.
    LineLow,
    /// Answers come, and none was good yet.
    Collision,
    /// Some answers are good, this one was not.
    Noise,
    /// A sensor answers that was not asked, or something that was not asked.
    Foreign,
    /// An ISU prints lines of text.
    AsciiOutput,
}

impl fmt::Display for Suspect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NeverAnswered => {
                "no sensor has answered yet; check the supply, the address, the bit rate, A and B, and that DE stays \
                 high until the last stop bit: `flush` of some UARTs returns early, see `Release`"
            }
            Self::Silent => {
                "other requests were answered; check supply, cable and address of this sensor"
            }
            Self::OwnEcho => {
                "only our own frame came back: the sensor is silent, and the receiver is on while we send; set \
                 `Echo::Expected`, or tie /RE to DE"
            }
            Self::LateAnswers => {
                "answers come after their deadline; the receiver hands them over late: give \
                 `Timing::handed_over_within`, or lower the threshold of its FIFO or the latency timer of the adapter"
            }
            Self::BitRate => {
                "characters have no stop bit: something sends at another bit rate; set UART, `PortSettings` and \
                 `Timing` to the sensor's"
            }
            Self::LineLow => {
                "the line is low for whole characters: swap A and B, give it a bias, or look for something that sends \
                 at a lower bit rate"
            }
            Self::Collision => {
                "answers come, and no good one yet: two sensors have one address, or the line is bad; connect one \
                 sensor alone, then check the termination"
            }
            Self::Noise => {
                "other answers were good; if it is always this sensor, two have its address; otherwise check \
                 termination, ground and cable"
            }
            Self::Foreign => {
                "this was not asked; check that there is no other master on the line"
            }
            Self::AsciiOutput => {
                "an ISU prints lines of text: its RX was low when it started; keep RX high and start it again"
            }
        })
    }
}
