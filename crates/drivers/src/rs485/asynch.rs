//! The line over `embedded_io_async` and `embedded_hal_async`'s delay.
//!
//! Dropping a future: DE falls at once, because a guard holds it; the next frame first waits until the UART has got rid
//! of what it still holds.

use core::future::{pending, poll_fn};
use core::ops::ControlFlow;
use core::pin::pin;
use core::task::Poll;

use clino_bus::Duration;
use clino_codec::character::Character;
use embedded_hal::digital::OutputPin;
use embedded_hal_async::delay::DelayNs;
use embedded_io_async::{Read, Write};

use super::driving::Driving;
use super::echo::EchoCheck;
use super::{Error, Rs485};
use crate::AsyncPort;
use crate::uart::Io;

/// An executor may be busy with other tasks for this long while the UART sends: after a longer time the UART counts as
/// stuck. Our choice.
const STALL: Duration = Duration::from_millis(20);

impl<U: Read + Write, DE: OutputPin, D: DelayNs> AsyncPort for Rs485<Io<U>, DE, D> {
    type Error = Error<U::Error, DE::Error>;

    async fn send(&mut self, frame: &[u8]) -> Result<(), Self::Error> {
        if frame.is_empty() {
            return Ok(());
        }
        let Self { uart, de, delay, settings, unfinished, refused, .. } = self;
        if *refused {
            de.set_low().map_err(Error::Pin)?;
            *refused = false;
        }
        let longest = settings.longest(frame.len()) + STALL;
        if *unfinished {
            within(delay, longest, uart.uart.flush())
                .await
                .ok_or(Error::Stuck { waited: longest })?
                .map_err(Error::Uart)?;
            pause(delay, settings.hold(usize::MAX)).await;
        }
        *unfinished = true;
        let driving = Driving::begin(de).map_err(Error::Pin)?;
        pause(delay, settings.before).await;
        within(delay, longest, write_all_and_flush(&mut uart.uart, frame))
            .await
            .flatten()
            .ok_or(Error::Stuck { waited: longest })?
            .map_err(Error::Uart)?;
        pause(delay, settings.hold(frame.len()) + settings.after).await;
        driving.end().map_err(Error::Pin)?;
        *unfinished = false;
        let mut echo = EchoCheck::new(settings.echo, frame);
        let whole = async {
            while echo.is_pending() {
                echo.take(receive(uart).await);
            }
        };
        // What is missing is the echo's own error.
        let _ = within(delay, settings.echo_time(), whole).await;
        Ok(echo.finish()?)
    }

    async fn listen(
        &mut self,
        span: Duration,
        mut take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Self { uart, delay, peeked, .. } = self;
        if let Some(character) = peeked.take() {
            take(character, span)?;
        }
        // One timer for the whole span: only so is its end known, as nothing tells the time when a character comes.
        let mut timer = pin!(delay.delay_us(span.as_micros()));
        loop {
            match first(receive(uart), timer.as_mut()).await {
                Some(character) => take(character, span)?,
                None => return ControlFlow::Continue(()),
            }
        }
    }
}

/// Hands over and sends a frame; `None` if the transmitter takes nothing.
async fn write_all_and_flush<U: Write>(uart: &mut U, frame: &[u8]) -> Option<Result<(), U::Error>> {
    let mut rest = frame;
    while !rest.is_empty() {
        match uart.write(rest).await {
            Ok(0) => return None,
            Ok(taken) => rest = rest.get(taken..).unwrap_or(&[]),
            Err(error) => return Some(Err(error)),
        }
    }
    Some(uart.flush().await)
}

async fn receive<U: Read>(uart: &mut Io<U>) -> Character {
    let mut byte = [0];
    let read = uart.uart.read(&mut byte).await;
    let [byte] = byte;
    match uart.character(read, byte) {
        Some(character) => character,
        // The end of the file: nothing comes any more.
        None => pending().await,
    }
}

/// What `future` comes to, if it does before `timer`.
async fn first<T>(future: impl Future<Output = T>, mut timer: impl Future<Output = ()> + Unpin) -> Option<T> {
    let mut future = pin!(future);
    poll_fn(|context| match future.as_mut().poll(context) {
        Poll::Ready(value) => Poll::Ready(Some(value)),
        Poll::Pending => core::pin::Pin::new(&mut timer).poll(context).map(|()| None),
    })
    .await
}

/// What `future` comes to within `span`.
async fn within<T>(delay: &mut impl DelayNs, span: Duration, future: impl Future<Output = T>) -> Option<T> {
    let timer = pin!(delay.delay_us(span.as_micros()));
    first(future, timer).await
}

/// Waits for at least `span`; zero costs nothing.
async fn pause(delay: &mut impl DelayNs, span: Duration) {
    if span > Duration::ZERO {
        delay.delay_us(span.as_micros()).await;
    }
}

/// One turn on the line per call of `write`.
impl<U: Read + Write, DE: OutputPin, D: DelayNs> Write for Rs485<Io<U>, DE, D> {
    async fn write(&mut self, buf: &[u8]) -> Result<usize, Self::Error> {
        self.send(buf).await.map(|()| buf.len())
    }

    async fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl<U: Read + Write, DE: OutputPin, D: DelayNs> Read for Rs485<Io<U>, DE, D> {
    /// Waits for one character, without a limit. A character with receiver errors is an error.
    async fn read(&mut self, buf: &mut [u8]) -> Result<usize, Self::Error> {
        let Some(place) = buf.first_mut() else { return Ok(0) };
        let character = match self.peeked.take() {
            Some(character) => character,
            None => receive(&mut self.uart).await,
        };
        if !character.errors.is_none() {
            return Err(Error::Receiver(character.errors));
        }
        *place = character.byte;
        Ok(1)
    }
}
