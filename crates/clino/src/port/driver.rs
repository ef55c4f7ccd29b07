//! RTS as the switch of the transceiver's driver: high before the first byte, low when all of a frame is out.

use std::io::{self, ErrorKind};

use serial2::SerialPort;

/// What is needed of a UART.
pub trait Uart {
    /// The level of RTS.
    fn set_rts(&self, on: bool) -> io::Result<()>;
    /// Hands over all bytes.
    fn write_all(&self, bytes: &[u8]) -> io::Result<()>;
    /// Waits until all bytes are out.
    fn flush(&self) -> io::Result<()>;
}

impl Uart for SerialPort {
    fn set_rts(&self, on: bool) -> io::Result<()> {
        Self::set_rts(self, on)
    }

    fn write_all(&self, bytes: &[u8]) -> io::Result<()> {
        Self::write_all(self, bytes)
    }

    fn flush(&self) -> io::Result<()> {
        Self::flush(self)
    }
}

/// The switch.
#[derive(Clone, Copy, Debug)]
pub struct Driver {
    /// RTS switches it; otherwise the adapter, or the kernel, does.
    pub by_rts: bool,
}

impl Driver {
    /// Hands over a frame, with the driver on. If that fails the driver is off: the pair is the others'.
    ///
    /// # Errors
    /// Those of the system.
    pub fn send(self, uart: &impl Uart, frame: &[u8]) -> io::Result<()> {
        if !self.by_rts {
            return uart.write_all(frame);
        }
        uart.set_rts(true)?;
        let written = uart.write_all(frame);
        if written.is_err() {
            // The first error is the one that is told.
            let _ = uart.set_rts(false);
        }
        written
    }

    /// The frame's own time is over: the driver is off when the system says that all of it is out.
    ///
    /// # Errors
    /// Those of the system.
    pub fn sent(self, uart: &impl Uart) -> io::Result<()> {
        if !self.by_rts {
            return Ok(());
        }
        let flushed = loop {
            match uart.flush() {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                flushed => break flushed,
            }
        };
        uart.set_rts(false).and(flushed)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;

    #[derive(Clone, Debug, PartialEq, Eq)]
    enum Done {
        Rts(bool),
        Wrote(Vec<u8>),
        Flushed,
    }

    /// A UART on a table.
    #[derive(Default)]
    struct Fake {
        done: RefCell<Vec<Done>>,
        write_fails: bool,
        /// Signals that interrupt the wait.
        interruptions: RefCell<u8>,
    }

    impl Uart for Fake {
        fn set_rts(&self, on: bool) -> io::Result<()> {
            self.done.borrow_mut().push(Done::Rts(on));
            Ok(())
        }

        fn write_all(&self, bytes: &[u8]) -> io::Result<()> {
            self.done.borrow_mut().push(Done::Wrote(bytes.to_vec()));
            if self.write_fails { Err(ErrorKind::TimedOut.into()) } else { Ok(()) }
        }

        fn flush(&self) -> io::Result<()> {
            if *self.interruptions.borrow() > 0 {
                *self.interruptions.borrow_mut() -= 1;
                return Err(ErrorKind::Interrupted.into());
            }
            self.done.borrow_mut().push(Done::Flushed);
            Ok(())
        }
    }

    const FRAME: [u8; 3] = [0x05, 0x01, 0x83];

    #[test]
    fn rts_is_high_around_the_frame_and_no_longer() {
        let fake = Fake { interruptions: RefCell::new(3), ..Fake::default() };
        let driver = Driver { by_rts: true };
        driver.send(&fake, &FRAME).unwrap();
        assert_eq!(*fake.done.borrow(), [Done::Rts(true), Done::Wrote(FRAME.to_vec())]);
        driver.sent(&fake).unwrap();
        let rest = fake.done.borrow().get(2..).map(<[Done]>::to_vec);
        assert_eq!(rest, Some(vec![Done::Flushed, Done::Rts(false)]));
    }

    #[test]
    fn a_frame_that_cannot_be_written_leaves_the_pair_to_the_others() {
        let fake = Fake { write_fails: true, ..Fake::default() };
        let error = Driver { by_rts: true }.send(&fake, &FRAME).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TimedOut);
        assert_eq!(fake.done.borrow().last(), Some(&Done::Rts(false)));
    }

    #[test]
    fn without_it_rts_is_left_alone() {
        let fake = Fake::default();
        let driver = Driver { by_rts: false };
        driver.send(&fake, &FRAME).unwrap();
        driver.sent(&fake).unwrap();
        assert_eq!(*fake.done.borrow(), [Done::Wrote(FRAME.to_vec())]);
    }
}
