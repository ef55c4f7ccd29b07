//! The loop between wall clock, terminals and pairs.
//!
//! It sleeps until the next event on a pair, or until a terminal or a signal wakes it up. A terminal that no program has
//! open reports that all the time; so the loop waits for edges, and checks every terminal in each turn.

use std::io::{self, Read as _};
use std::os::unix::net::UnixStream;
use std::time::Instant;

use clino_pty::Terminal;
use clino_sim::node::Ns;
use rustix::buffer::spare_capacity;
use rustix::event::{PollFd, PollFlags, Timespec, epoll, poll};
use rustix::io::{Errno, retry_on_intr};
use signal_hook::consts::signal::{SIGINT, SIGTERM};
use signal_hook::low_level::pipe;

use super::adapter::Adapter;
use super::chatter::Chatter;

/// Bytes taken from a terminal at once.
const CHUNK: usize = 256;
/// Edges fetched at once; none is lost, since none is looked at.
const EDGES: usize = 8;
const NS_PER_S: u64 = 1_000_000_000;

/// A pair and the terminal it is served on.
pub struct Bus {
    pub terminal: Terminal,
    pub adapter: Adapter,
    pub chatter: Chatter,
}

/// Becomes readable when the process is asked to end.
pub struct Stop(UnixStream);

impl Stop {
    /// By SIGINT or SIGTERM.
    pub fn on_signals() -> io::Result<Self> {
        let (ours, theirs) = UnixStream::pair()?;
        ours.set_nonblocking(true)?;
        pipe::register(SIGINT, theirs.try_clone()?)?;
        pipe::register(SIGTERM, theirs)?;
        Ok(Self(ours))
    }

    fn is_asked(&self) -> io::Result<bool> {
        match (&self.0).read(&mut [0]) {
            Ok(_) => Ok(true),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(false),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(false),
            Err(error) => Err(error),
        }
    }
}

/// Serves the buses until `stop`.
pub fn until(stop: &Stop, buses: &mut [Bus]) -> io::Result<()> {
    let wakers = epoll::create(epoll::CreateFlags::CLOEXEC)?;
    let ignored = epoll::EventData::new_u64(0);
    epoll::add(&wakers, &stop.0, ignored, epoll::EventFlags::IN)?;
    for bus in &*buses {
        epoll::add(&wakers, &bus.terminal, ignored, epoll::EventFlags::IN | epoll::EventFlags::ET)?;
    }
    let start = Instant::now();
    let mut edges = Vec::with_capacity(EDGES);
    while !stop.is_asked()? {
        let mut next = None;
        for bus in &mut *buses {
            bus.turn(start)?;
            next = bus.adapter.next_event().into_iter().chain(next).min();
        }
        // The wait has nanoseconds; `epoll`'s own rounds to milliseconds.
        let timeout = next.map(|next| timespec(next.saturating_sub(elapsed(start))));
        match poll(&mut [PollFd::new(&wakers, PollFlags::IN)], timeout.as_ref()) {
            Ok(0) | Err(Errno::INTR) => {}
            Ok(_) => {
                edges.clear();
                retry_on_intr(|| epoll::wait(&wakers, spare_capacity(&mut edges), Some(&timespec(0))))?;
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

impl Bus {
    /// Takes what the program has written, and lets everything up to now happen.
    fn turn(&mut self, start: Instant) -> io::Result<()> {
        let mut buffer = [0; CHUNK];
        loop {
            let room = self.adapter.room().min(CHUNK);
            let bytes = self.terminal.read(buffer.split_at_mut(room).0)?;
            // Read first: were it later than the look at the clock, the command would have come before it was written.
            let now = elapsed(start);
            self.terminal.deliver(&self.adapter.run(now))?;
            if let Some(baud) = self.terminal.baud()? {
                self.adapter.set_baud(now, baud);
            }
            if bytes.is_empty() {
                break;
            }
            self.adapter.send(now, bytes);
        }
        self.chatter.tell();
        Ok(())
    }
}

fn elapsed(start: Instant) -> Ns {
    u64::try_from(start.elapsed().as_nanos()).unwrap_or(Ns::MAX)
}

fn timespec(time: Ns) -> Timespec {
    let seconds = i64::try_from(time / NS_PER_S).unwrap_or(i64::MAX);
    Timespec { tv_sec: seconds, tv_nsec: (time % NS_PER_S).cast_signed() }
}
