//! Runs a future that never waits.
//!
//! `sequential-storage` is written for flash that can be waited for. This part's flash cannot: the core stands still
//! while it is busy, so that every future over it is ready the first time it is asked.

use core::pin::pin;
use core::task::{Context, Poll, Waker};

/// What the future comes to; `None` if it wants to wait after all.
pub fn now<F: Future>(future: F) -> Option<F::Output> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => Some(output),
        Poll::Pending => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ready_or_not() {
        assert_eq!(now(async { core::future::ready(1).await + 1 }), Some(2));
        assert_eq!(now(core::future::pending::<()>()), None);
    }
}
