//! The UART of the board: a data register (or a buffer) in front of a shift register, and a receive buffer.
//!
//! One type implements the blocking, the non-blocking and the async traits. Receiver errors take their character with
//! them, as in most HALs.

use std::collections::VecDeque;
use std::fmt;

use clino_segment::Segment;
use clino_segment::wire::{Format, Received, Sent, Wire as _};
use clino_sim::node::Ns;
use embedded_hal_nb::serial::{self, ErrorKind};

use super::{Board, CALL, World};

const PS_PER_S: u64 = 1_000_000_000_000;
const PS_PER_NS: u64 = 1_000;
const BITS: u64 = 10;

/// When `flush` returns.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Flush {
    /// When the last stop bit is out, as it should.
    TransmissionComplete,
    /// When the last character has left the data register: one too early.
    RegisterEmpty,
    /// At once.
    Never,
}

/// When a received character can be read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Handover {
    /// With its stop bit.
    AtOnce,
    /// With the character that fills a FIFO to its threshold, or after a silence.
    Fifo {
        /// Characters.
        threshold: usize,
        /// Bits of silence.
        silence: u64,
    },
    /// With the next packet; there is one in each period.
    Packets {
        /// Nanoseconds.
        period: Ns,
    },
}

/// What kind of UART it is.
#[derive(Clone, Copy)]
pub struct Model {
    /// When `flush` returns.
    pub flush: Flush,
    /// Characters that wait in front of the shift register.
    pub transmit_buffer: usize,
    /// Characters that wait to be read.
    pub receive_buffer: usize,
    /// When they can be.
    pub handover: Handover,
}

impl Model {
    /// The UART of a small microcontroller: one register each way.
    pub const BARE: Model = Model {
        flush: Flush::TransmissionComplete,
        transmit_buffer: 1,
        receive_buffer: 1,
        handover: Handover::AtOnce,
    };
    /// A UART that a driver with interrupts and buffers serves.
    pub const BUFFERED: Model = Model { transmit_buffer: 64, receive_buffer: 64, ..Model::BARE };
}

/// The hardware.
pub(super) struct Registers {
    model: Model,
    bit_ps: u64,
    /// End of the character in the shift register, picoseconds.
    shifting: Option<u64>,
    transmit: VecDeque<u8>,
    receive: VecDeque<Result<u8, LineError>>,
    /// The number of these that can be read.
    handed_over: usize,
    /// When the others can be.
    hand_over_at: Option<Ns>,
    jammed: bool,
}

impl Registers {
    pub(super) fn new(baud: u32, model: Model) -> Registers {
        let bit_ps = PS_PER_S / u64::from(baud);
        let (transmit, receive) = (VecDeque::new(), VecDeque::new());
        let (handed_over, hand_over_at) = (0, None);
        Registers {
            model,
            bit_ps,
            shifting: None,
            transmit,
            receive,
            handed_over,
            hand_over_at,
            jammed: false,
        }
    }

    pub(super) fn format(&self) -> Format {
        Format { bit_ps: self.bit_ps, data_bits: 8, stop_halves: 2 }
    }

    pub(super) fn next_event(&self) -> Option<Ns> {
        let sent = self.shifting.map(|end| end.div_ceil(PS_PER_NS));
        [sent, self.hand_over_at].into_iter().flatten().min()
    }

    pub(super) fn run(&mut self, now: Ns, segment: &mut Segment) {
        if let Some(end) = self.shifting.take_if(|end| end.div_ceil(PS_PER_NS) <= now) {
            self.shift(end, segment);
        }
        while let Some(received) = segment.take_received() {
            self.receive(received);
            self.schedule(now);
        }
        if self.hand_over_at.take_if(|at| *at <= now).is_some() {
            self.handed_over = self.receive.len();
        }
    }

    /// A character was received: when can it be read?
    fn schedule(&mut self, now: Ns) {
        match self.model.handover {
            Handover::AtOnce => self.handed_over = self.receive.len(),
            Handover::Fifo { threshold, silence } => {
                let waiting = self.receive.len() - self.handed_over;
                let silence = silence * self.bit_ps / PS_PER_NS;
                self.hand_over_at = Some(if waiting >= threshold { now } else { now + silence });
            }
            Handover::Packets { period } => {
                self.hand_over_at.get_or_insert((now / period + 1) * period);
            }
        }
    }

    /// The next character that can be read.
    fn take(&mut self) -> Option<Result<u8, LineError>> {
        self.handed_over = self.handed_over.checked_sub(1)?;
        self.receive.pop_front()
    }

    /// Starts the next character, if there is one.
    fn shift(&mut self, start_ps: u64, segment: &mut Segment) {
        if let Some(byte) = self.transmit.pop_front() {
            self.shifting = Some(start_ps + BITS * self.bit_ps);
            let format = self.format();
            segment.send(Sent { start: start_ps / PS_PER_NS, word: u16::from(byte), format });
        }
    }

    fn receive(&mut self, received: Received) {
        let character = match received {
            Received { framing_error: true, .. } => Err(LineError(ErrorKind::FrameFormat)),
            Received { noise: true, .. } => Err(LineError(ErrorKind::Noise)),
            Received { word, .. } => Ok(word as u8),
        };
        if self.receive.len() < self.model.receive_buffer {
            self.receive.push_back(character);
        } else {
            *self.receive.back_mut().expect("the buffer is full") = Err(LineError(ErrorKind::Overrun));
        }
    }

    fn is_flushed(&self) -> bool {
        match self.model.flush {
            Flush::TransmissionComplete => self.shifting.is_none(),
            Flush::RegisterEmpty => self.transmit.is_empty(),
            Flush::Never => true,
        }
    }
}

impl World {
    fn transmit(&mut self, byte: u8) -> bool {
        let uart = &mut self.uart;
        if uart.jammed || uart.transmit.len() >= uart.model.transmit_buffer {
            return false;
        }
        uart.transmit.push_back(byte);
        if uart.shifting.is_none() {
            uart.shift(self.now * PS_PER_NS, &mut self.segment);
        }
        true
    }
}

/// The UART, as a HAL gives it.
pub struct Uart(pub(super) Board);

impl Uart {
    /// The transmitter takes nothing while it is jammed.
    pub fn jam(&self, jammed: bool) {
        self.0.call(|world| world.uart.jammed = jammed);
    }

    /// Another bit rate.
    pub fn set_baud(&self, baud: u32) {
        self.0.call(|world| {
            world.uart.bit_ps = PS_PER_S / u64::from(baud);
            let format = world.uart.format();
            world.segment.set_receiver(world.now, Some(format));
        });
    }

    fn block<T>(&self, mut attempt: impl FnMut(&mut World) -> Option<T>) -> T {
        loop {
            if let Some(done) = self.0.call(&mut attempt) {
                return done;
            }
            // It spins until something happens.
            let mut world = self.0.0.borrow_mut();
            let next = world.next_event().unwrap_or(0).max(world.now + CALL);
            world.advance(next);
        }
    }
}

/// What the receiver complains about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineError(pub ErrorKind);

impl fmt::Display for LineError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for LineError {}

impl serial::Error for LineError {
    fn kind(&self) -> ErrorKind {
        self.0
    }
}

impl serial::ErrorType for Uart {
    type Error = LineError;
}

impl serial::Read for Uart {
    fn read(&mut self) -> nb::Result<u8, LineError> {
        match self.0.call(|world| world.uart.take()) {
            Some(read) => read.map_err(nb::Error::Other),
            None => Err(nb::Error::WouldBlock),
        }
    }
}

impl serial::Write for Uart {
    fn write(&mut self, word: u8) -> nb::Result<(), LineError> {
        let taken = self.0.call(|world| world.transmit(word));
        if taken { Ok(()) } else { Err(nb::Error::WouldBlock) }
    }

    fn flush(&mut self) -> nb::Result<(), LineError> {
        let flushed = self.0.call(|world| world.uart.is_flushed());
        if flushed { Ok(()) } else { Err(nb::Error::WouldBlock) }
    }
}

impl embedded_io::Error for LineError {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::Other
    }
}

impl embedded_io::ErrorType for Uart {
    type Error = LineError;
}

impl embedded_io::ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, LineError> {
        Ok(self.0.call(|world| world.uart.handed_over > 0))
    }
}

impl embedded_io::Read for Uart {
    fn read(&mut self, buf: &mut [u8]) -> Result<usize, LineError> {
        let Some(place) = buf.first_mut() else { return Ok(0) };
        *place = self.block(|world| world.uart.take())?;
        Ok(1)
    }
}

impl embedded_io::Write for Uart {
    fn write(&mut self, buf: &[u8]) -> Result<usize, LineError> {
        let Some(&first) = buf.first() else { return Ok(0) };
        self.block(|world| world.transmit(first).then_some(()));
        let rest = buf[1..].iter().take_while(|&&byte| self.0.call(|world| world.transmit(byte)));
        Ok(1 + rest.count())
    }

    fn flush(&mut self) -> Result<(), LineError> {
        self.block(|world| world.uart.is_flushed().then_some(()));
        Ok(())
    }
}

#[cfg(feature = "embedded-io-06")]
mod embedded_io_06_traits {
    use super::{LineError, Uart};

    impl embedded_io_06::Error for LineError {
        fn kind(&self) -> embedded_io_06::ErrorKind {
            embedded_io_06::ErrorKind::Other
        }
    }

    impl embedded_io_06::ErrorType for Uart {
        type Error = LineError;
    }

    impl embedded_io_06::ReadReady for Uart {
        fn read_ready(&mut self) -> Result<bool, LineError> {
            embedded_io::ReadReady::read_ready(self)
        }
    }

    impl embedded_io_06::Read for Uart {
        fn read(&mut self, buf: &mut [u8]) -> Result<usize, LineError> {
            embedded_io::Read::read(self, buf)
        }
    }

    impl embedded_io_06::Write for Uart {
        fn write(&mut self, buf: &[u8]) -> Result<usize, LineError> {
            embedded_io::Write::write(self, buf)
        }

        fn flush(&mut self) -> Result<(), LineError> {
            embedded_io::Write::flush(self)
        }
    }
}

#[cfg(feature = "async")]
mod async_traits {
    use std::future::poll_fn;
    use std::task::Poll;

    use super::{LineError, Uart, World};

    impl Uart {
        async fn when<T>(&self, mut attempt: impl FnMut(&mut World) -> Option<T>) -> T {
            // The executor polls whenever something has happened.
            poll_fn(|_| self.0.call(&mut attempt).map_or(Poll::Pending, Poll::Ready)).await
        }
    }

    impl embedded_io_async::Read for Uart {
        async fn read(&mut self, buf: &mut [u8]) -> Result<usize, LineError> {
            let Some(place) = buf.first_mut() else { return Ok(0) };
            *place = self.when(|world| world.uart.take()).await?;
            Ok(1)
        }
    }

    impl embedded_io_async::Write for Uart {
        async fn write(&mut self, buf: &[u8]) -> Result<usize, LineError> {
            let Some(&first) = buf.first() else { return Ok(0) };
            self.when(|world| world.transmit(first).then_some(())).await;
            Ok(1)
        }

        async fn flush(&mut self) -> Result<(), LineError> {
            self.when(|world| world.uart.is_flushed().then_some(())).await;
            Ok(())
        }
    }
}
