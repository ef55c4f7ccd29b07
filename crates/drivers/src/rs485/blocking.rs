//! The line over `embedded_hal`'s delay.

use core::ops::ControlFlow;

use clino_bus::Duration;
use clino_codec::character::Character;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;

use super::driving::Driving;
use super::echo::EchoCheck;
use super::{Error, PortSettings, Rs485};
use crate::Port;
use crate::uart::Uart;

impl<U: Uart, DE: OutputPin, D: DelayNs> Port for Rs485<U, DE, D> {
    type Error = Error<U::Error, DE::Error>;

    fn send(&mut self, frame: &[u8]) -> Result<(), Self::Error> {
        if frame.is_empty() {
            return Ok(());
        }
        let Self { uart, de, delay, settings, unfinished, refused, .. } = self;
        if *refused {
            de.set_low().map_err(Error::Pin)?;
            *refused = false;
        }
        let mut patience = Patience::new(delay, settings, frame.len());
        if *unfinished {
            patience.drain(uart)?;
            patience.pause(settings.hold(usize::MAX));
        }
        *unfinished = true;
        let mut echo = EchoCheck::new(settings.echo, frame);
        let driving = Driving::begin(de).map_err(Error::Pin)?;
        patience.pause(settings.before);
        patience.waited = Duration::ZERO;
        patience.feed(uart, frame, &mut echo)?;
        patience.drain(uart)?;
        patience.pause(settings.hold(frame.len()) + settings.after);
        driving.end().map_err(Error::Pin)?;
        *unfinished = false;
        // Only now: a receiver that is late with the last one must not keep DE high.
        patience.await_echo(uart, &mut echo, 0);
        Ok(echo.finish()?)
    }

    fn listen(
        &mut self,
        span: Duration,
        mut take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut waited = Duration::ZERO;
        loop {
            while let Some(character) = self.receive() {
                take(character, waited)?;
            }
            if waited >= span {
                return ControlFlow::Continue(());
            }
            let step = self.settings.listen_step().min(span - waited);
            waited = waited + pause(&mut self.delay, step);
        }
    }
}

impl<U: Uart, DE, D> Rs485<U, DE, D> {
    /// The next character received, if there is one.
    fn receive(&mut self) -> Option<Character> {
        self.peeked.take().or_else(|| self.uart.receive())
    }
}

/// Waits for a transmitter, but not for ever.
struct Patience<'a, D> {
    delay: &'a mut D,
    step: Duration,
    waited: Duration,
    longest: Duration,
    /// How long a character may take to come back.
    echo: Duration,
    /// The receiver holds one character: the frame is handed over one by one.
    one_by_one: bool,
}

impl<'a, D: DelayNs> Patience<'a, D> {
    fn new(delay: &'a mut D, settings: &PortSettings, length: usize) -> Self {
        let (step, longest, echo) = (settings.send_step(), settings.longest(length), settings.echo_time());
        let one_by_one = settings.handover == Duration::ZERO;
        Self { delay, step, waited: Duration::ZERO, longest, echo, one_by_one }
    }

    /// Hands over the frame; with an echo character by character, so that a receiver that holds one character keeps up.
    fn feed<U: Uart, P>(
        &mut self,
        uart: &mut U,
        frame: &[u8],
        echo: &mut EchoCheck<'_>,
    ) -> Result<(), Error<U::Error, P>> {
        let mut rest = frame;
        while !rest.is_empty() {
            let chunk = rest.get(..1).filter(|_| self.one_by_one && echo.is_pending()).unwrap_or(rest);
            match uart.write(chunk).map_err(Error::Uart)? {
                0 => self.wait()?,
                taken => {
                    rest = rest.get(taken..).unwrap_or(&[]);
                    if self.one_by_one && !rest.is_empty() {
                        self.await_echo(uart, echo, rest.len());
                    }
                }
            }
        }
        Ok(())
    }

    /// Waits until no more than `left` characters have still to come back.
    fn await_echo<U: Uart>(&mut self, uart: &mut U, echo: &mut EchoCheck<'_>, left: usize) {
        let mut waited = Duration::ZERO;
        while echo.pending() > left {
            match uart.receive() {
                Some(character) => echo.take(character),
                None if waited >= self.echo => return echo.give_up(),
                None => waited = waited + self.pause(self.step),
            }
        }
    }

    /// Waits until everything is sent.
    fn drain<U: Uart, P>(&mut self, uart: &mut U) -> Result<(), Error<U::Error, P>> {
        while !uart.flush().map_err(Error::Uart)? {
            self.wait()?;
        }
        Ok(())
    }

    fn wait<U, P>(&mut self) -> Result<(), Error<U, P>> {
        if self.waited >= self.longest {
            return Err(Error::Stuck { waited: self.waited });
        }
        self.waited = self.waited + self.pause(self.step);
        Ok(())
    }

    /// As [`pause`].
    fn pause(&mut self, span: Duration) -> Duration {
        pause(self.delay, span)
    }
}

/// Waits for at least `span` and returns it; zero costs nothing. In one place: a delay may be long code.
#[inline(never)]
fn pause(delay: &mut impl DelayNs, span: Duration) -> Duration {
    if span > Duration::ZERO {
        delay.delay_us(span.as_micros());
    }
    span
}

#[cfg(feature = "embedded-io")]
mod embedded_io_traits {
    use embedded_io::{ErrorType, Read, ReadReady, Write};

    use super::{DelayNs, Error, OutputPin, Port, Rs485, Uart, pause};

    impl<U: crate::uart::ErrorType, DE: OutputPin, D> ErrorType for Rs485<U, DE, D> {
        type Error = Error<U::Error, DE::Error>;
    }

    impl<U: Uart, DE: OutputPin, D: DelayNs> Write for Rs485<U, DE, D> {
        /// One turn on the line: sends all of `buf`.
        fn write(&mut self, buf: &[u8]) -> Result<usize, Self::Error> {
            self.send(buf).map(|()| buf.len())
        }

        fn flush(&mut self) -> Result<(), Self::Error> {
            Ok(())
        }
    }

    impl<U: Uart, DE: OutputPin, D: DelayNs> ReadReady for Rs485<U, DE, D> {
        fn read_ready(&mut self) -> Result<bool, Self::Error> {
            self.peeked = self.receive();
            Ok(self.peeked.is_some())
        }
    }

    impl<U: Uart, DE: OutputPin, D: DelayNs> Read for Rs485<U, DE, D> {
        /// Waits for one character without a limit, and takes what else is there. A character with receiver errors
        /// is an error of its own, in its place.
        fn read(&mut self, buf: &mut [u8]) -> Result<usize, Self::Error> {
            if buf.is_empty() {
                return Ok(0);
            }
            while !self.read_ready()? {
                pause(&mut self.delay, self.settings.listen_step());
            }
            let mut length: usize = 0;
            for place in buf {
                match self.receive() {
                    Some(character) if character.errors.is_none() => *place = character.byte,
                    Some(character) if length == 0 => return Err(Error::Receiver(character.errors)),
                    other => {
                        self.peeked = other;
                        break;
                    }
                }
                length = length.saturating_add(1);
            }
            Ok(length)
        }
    }
}
