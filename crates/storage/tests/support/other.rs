//! Another firmware, which stores records of its own.

use std::pin::pin;
use std::task::{Context, Poll, Waker};

use clino_storage::pages::{PAGES, Pages};
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};

use super::flash::Flash;

/// Longest record it has room for, bytes.
pub const LONGEST: usize = 8_192;

/// Stores a record, whatever is in it; says whether that went well.
pub fn put(record: &[u8], flash: &mut Flash) -> bool {
    let pages = Pages::new(flash);
    let mut map = MapStorage::<(), _, _>::new(pages, MapConfig::new(0..PAGES), Cache::new_uncached());
    let mut buffer = [0; LONGEST];
    let storing = pin!(map.store_item(&mut buffer, &(), &record));
    match storing.poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => result.is_ok(),
        Poll::Pending => panic!("there is nothing to wait for"),
    }
}
