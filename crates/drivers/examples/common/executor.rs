//! The smallest executor for virtual time: polls, and where nothing can be done, lets time pass to the next event.

use std::future::poll_fn;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use clino_sim::node::Ns;
use embedded_hal_async::delay::DelayNs;

use super::{Board, CALL, Delay};

/// Runs a future to its end.
pub fn block_on<T>(board: &Board, future: impl Future<Output = T>) -> T {
    block_on_until(board, Ns::MAX, future).expect("it has for ever")
}

/// Runs a future to its end, or drops it at `until`.
pub fn block_on_until<T>(board: &Board, until: Ns, future: impl Future<Output = T>) -> Option<T> {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return Some(value);
        }
        let mut world = board.0.borrow_mut();
        let next = world.next_event().expect("a task waits for an event").max(world.now);
        world.advance(next.min(until));
        if world.now >= until {
            return None;
        }
    }
}

/// Runs a future to its end, or drops it after this many polls: at each place where it can wait, if tried
/// with every number.
pub fn block_on_polls<T>(board: &Board, polls: usize, future: impl Future<Output = T>) -> Option<T> {
    let mut future = pin!(future);
    let mut context = Context::from_waker(Waker::noop());
    for _ in 0..polls {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return Some(value);
        }
        let mut world = board.0.borrow_mut();
        let next = world.next_event().expect("a task waits for an event").max(world.now);
        world.advance(next);
    }
    None
}

/// A timer that is forgotten when it is dropped.
struct Timer {
    board: Board,
    id: u64,
    until: Ns,
}

impl Timer {
    fn new(board: &Board, span: Ns) -> Timer {
        let board = board.clone();
        let (id, until) = board.call(|world| {
            let id = world.timers.last_key_value().map_or(0, |(last, _)| last + 1);
            let until = world.now + span;
            world.timers.insert(id, until);
            (id, until)
        });
        Timer { board, id, until }
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        self.board.0.borrow_mut().timers.remove(&self.id);
    }
}

impl DelayNs for Delay {
    async fn delay_ns(&mut self, ns: u32) {
        let timer = Timer::new(&self.0, Ns::from(ns) + CALL);
        let over = || timer.board.now() >= timer.until;
        poll_fn(|_| if over() { Poll::Ready(()) } else { Poll::Pending }).await;
    }
}
