//! Durations on the line, and the waits derived from them.

use crate::{Duration, Serial, line};

/// Characters for which a T7 line may be busy at most: twice the longest answer of 34.
const T7_BUSY: u32 = 68;
/// The same for the ISU: the longest answer that its length byte can announce.
const ISU_BUSY: u32 = 257;

/// The waits of one master on one line. All spans in microseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Timing {
    /// Bit rate and framing.
    pub serial: Serial,
    /// Silence kept between the end of anything heard and our next driver-enable: the sensor's own driver
    /// needs time to release the line.
    pub guard: Duration,
    /// Longest time from our last stop bit to the first start bit of the answer of a reading request.
    pub get_latency: Duration,
    /// The same for a request that writes non-volatile memory.
    pub set_latency: Duration,
    /// Allowance for our own clock, interrupt latency and the sensor's oscillator, on top of the latency.
    pub margin: Duration,
    /// Longest pause between two characters of one answer before it counts as cut off.
    pub gap: Duration,
    /// Silence kept after a failed exchange, before the next request. A late or garbled answer that begins in it
    /// is heard to its end (until there is a `gap`) before the next request.
    pub quiet: Duration,
    /// The same after a node that has answered the last time it was asked missed its deadline: it may be slow.
    pub patience: Duration,
    /// How long after its deadline an answer may still begin. Within this, no answer that may be the late one is taken
    /// for the answer to a later request.
    pub late: Duration,
    /// The latencies are prolonged by up to this much for sensors that were seen to need it.
    pub extension: Duration,
    /// Longest wait for the line to fall silent before a request; then it is dropped. As long as any answer.
    pub line_busy: Duration,
}

impl Timing {
    /// T7 at `serial`: Get answers begin within 2 ms, Set answers within 25 ms (T7 guide section 1). The guard is
    /// one character. A dead node costs 3 characters + 2 ms + 2 characters, 2.44 ms at 115200 bit/s.
    pub const fn t7(serial: Serial) -> Timing {
        Timing {
            serial,
            guard: serial.characters(1),
            get_latency: Duration::from_micros(2_000),
            set_latency: Duration::from_micros(25_000),
            margin: serial.characters(1),
            gap: serial.characters(4),
            quiet: serial.characters(1),
            // Our choice: four times the documented latency, together with it.
            patience: Duration::from_micros(6_000),
            // As long as a Set may take: a device that was busy with its flash may be that late.
            late: Duration::from_micros(25_000),
            extension: Duration::from_micros(2_000),
            line_busy: serial.characters(T7_BUSY),
        }
    }

    /// ISU: no answer time is documented beyond TXEN rising 1 ms before the first bit (AN #201 section 2, TXEN).
    /// Our choice: 50 ms plus that lead for a reading; for an EEPROM write the only time the document names
    /// for a message, 400 ms (AN #201 section 4, Command Timeout).
    pub const fn isu() -> Timing {
        let serial = Serial::ISU;
        Timing {
            serial,
            guard: serial.characters(1),
            get_latency: Duration::from_micros(51_000),
            set_latency: Duration::from_micros(401_000),
            margin: serial.characters(1),
            gap: serial.characters(10),
            quiet: serial.characters(2),
            patience: Duration::from_micros(50_000),
            // The message timeout is the only limit that the document knows (AN #201 section 4, Command Timeout). A
            // module that has lost step is silent, and takes all we send for the rest of a message, until there were
            // 400 ms in which we sent nothing: this is the wait for that, too.
            late: Duration::from_micros(400_000),
            extension: Duration::from_micros(50_000),
            line_busy: serial.characters(ISU_BUSY),
        }
    }

    /// For a receiver that hands over a character up to `delay` after its stop bit: a FIFO that interrupts at a threshold
    /// or when the line is idle, a USB adapter that sends what it has every 1 to 16 ms.
    ///
    /// Such a delay looks like a slow sensor and like a pause within an answer. So latency and gap grow together, and
    /// with them how long a late answer is waited for. A dead node costs `delay` more.
    ///
    /// ```
    /// use clino_bus::{Duration, Serial, Timing};
    ///
    /// // A FIFO of 32 characters that interrupts at 28, or after four characters of silence.
    /// let serial = Serial::T7_DEFAULT;
    /// let timing = Timing::t7(serial).handed_over_within(serial.characters(32));
    /// assert_eq!(timing.gap, serial.characters(4) + serial.characters(32));
    /// ```
    #[must_use]
    pub const fn handed_over_within(self, delay: Duration) -> Timing {
        Timing {
            get_latency: self.get_latency.plus(delay),
            set_latency: self.set_latency.plus(delay),
            gap: self.gap.plus(delay),
            quiet: self.quiet.plus(delay),
            patience: self.patience.plus(delay),
            late: self.late.plus(delay),
            ..self
        }
    }

    /// The line that goes with these waits: no delay around DE, no echo.
    pub const fn line(&self) -> line::LineSettings {
        line::LineSettings::new(self.serial, self.guard)
    }

    /// From the end of our last stop bit to the instant by which the first character of the answer must have
    /// been received whole.
    pub const fn first_character(&self, latency: Duration) -> Duration {
        latency.plus(self.serial.characters(1)).plus(self.margin)
    }
}
