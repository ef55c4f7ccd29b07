use super::*;
use crate::store::Store;

use std::collections::BTreeMap;

fn message(n: u64) -> Message {
    Message { topic: "clino/one/state".into(), payload: format!("{n}").into_bytes(), retain: false }
}

fn number(message: &Message) -> u64 {
    String::from_utf8_lossy(&message.payload).parse().expect("a number")
}

struct Folder(std::path::PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = std::env::temp_dir().join(format!("clino-queue-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        Folder(path)
    }

    fn open(&self, most: u64) -> Queue {
        let store = Store::open(&self.0.join("queue.redb")).expect("a store");
        Queue::new(Lane::of(&store, None).expect("a lane"), Bounds::shared(most, 1))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Random generator of Lehmer, so that a failure repeats.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 % sides
    }
}

/// A broker that confirms late, out of order within its window, or is away; a program that ends and is killed. Everything
/// that was in the store or in memory arrives, in order of the first time it arrives.
#[test]
fn everything_arrives_in_order_whatever_happens() {
    for seed in 1..=20 {
        let folder = Folder::new(&format!("order-{seed}"));
        let mut dice = Dice(seed);
        let mut queue = folder.open(1_000_000);
        let (mut pushed, mut arrived, mut lost) = (0, Vec::new(), BTreeSet::new());
        let mut flight = Vec::new();
        let mut now = Instant::now();
        let mut memory: BTreeMap<u64, Instant> = BTreeMap::new();
        for _ in 0..400 {
            now += Duration::from_millis(dice.roll(120));
            match dice.roll(12) {
                0..=4 => {
                    queue.push(message(pushed), now);
                    memory.insert(pushed, now);
                    pushed += 1;
                }
                5..=7 => {
                    for _ in 0..dice.roll(6) {
                        if let Some((id, sent)) = queue.send_next() {
                            arrived.push(number(&sent));
                            flight.push((id, number(&sent)));
                        }
                    }
                }
                8 | 9 => {
                    for _ in 0..dice.roll(8) {
                        if !flight.is_empty() {
                            let at = usize::try_from(dice.roll(flight.len() as u64)).expect("small");
                            let (id, number) = flight.remove(at);
                            queue.confirm(id);
                            memory.remove(&number);
                        }
                    }
                }
                10 => {
                    queue.rewind();
                    flight.clear();
                }
                _ => {
                    tick(&mut [&mut queue], now);
                    memory.retain(|_, at| now - *at < SPILL_AFTER);
                    if dice.roll(6) == 0 {
                        // Killed.
                        lost.extend(memory.keys().copied());
                        memory.clear();
                        flight.clear();
                        drop(queue);
                        queue = folder.open(1_000_000);
                    }
                }
            }
        }
        queue.rewind();
        while let Some((id, sent)) = queue.send_next() {
            arrived.push(number(&sent));
            queue.confirm(id);
        }
        tick(&mut [&mut queue], now);
        let mut seen = BTreeSet::new();
        let firsts: Vec<_> = arrived.iter().copied().filter(|number| seen.insert(*number)).collect();
        assert!(firsts.is_sorted(), "seed {seed}: {firsts:?}");
        let missing: BTreeSet<_> = (0..pushed).filter(|number| !seen.contains(number)).collect();
        assert!(missing.is_subset(&lost), "seed {seed}: {missing:?} of {lost:?}");
        assert_eq!((queue.waiting(), queue.dropped()), (0, 0), "seed {seed}");
    }
}

#[test]
fn a_broker_that_confirms_at_once_leaves_the_disk_alone() {
    let folder = Folder::new("quick");
    let mut queue = folder.open(1_000_000);
    let now = Instant::now();
    for n in 0..1_000 {
        queue.push(message(n), now);
        let (id, _) = queue.send_next().expect("one");
        queue.confirm(id);
        tick(&mut [&mut queue], now + SPILL_AFTER);
    }
    assert_eq!(queue.disk, 1_000..1_000);
    assert_eq!(queue.disk_bytes, 0);
    drop(queue);
    let store = Store::open(&folder.0.join("queue.redb")).expect("a store");
    let (_, opened) = Lane::of(&store, None).expect("a lane");
    assert_eq!((opened.waiting, store.run()), (0..0, 2));
}

#[test]
fn beyond_the_bound_the_oldest_go_and_are_counted() {
    let folder = Folder::new("bound");
    let each = message(10).size();
    let mut queue = folder.open(10 * each);
    let mut now = Instant::now();
    for n in 10..40 {
        queue.push(message(n), now);
        now += SPILL_AFTER;
        tick(&mut [&mut queue], now);
    }
    assert_eq!(queue.dropped(), 20);
    let left: Vec<_> = std::iter::from_fn(|| queue.send_next()).map(|(_, sent)| number(&sent)).collect();
    assert_eq!(left, (30..40).collect::<Vec<_>>());
}

#[test]
fn queues_of_one_store_are_written_together_and_kept_apart() {
    let folder = Folder::new("lanes");
    let path = folder.0.join("queue.redb");
    let lanes = |store: &std::sync::Arc<Store>| {
        ["north", "south"].map(|name| {
            let lane = Lane::of(store, Some(name)).expect("a lane");
            Queue::new(lane, Bounds::shared(1_000_000, 2))
        })
    };
    let store = Store::open(&path).expect("a store");
    let mut queues = lanes(&store);
    let now = Instant::now();
    for n in 0..6 {
        queues[usize::from(n >= 2)].push(message(n), now);
    }
    tick(&mut queues.iter_mut().collect::<Vec<_>>(), now + SPILL_AFTER);
    // The first of the north arrives, in the answer to what was sent behind it.
    assert_eq!(queues[0].send_next().map(|(id, _)| id), Some(0));
    assert_eq!(queues[0].confirm_below(1), 1);
    tick(&mut queues.iter_mut().collect::<Vec<_>>(), now + SPILL_AFTER);
    drop((queues, store));
    let store = Store::open(&path).expect("a store");
    let left = lanes(&store).map(|mut queue| {
        let sent = std::iter::from_fn(|| queue.send_next());
        sent.map(|(_, sent)| number(&sent)).collect::<Vec<_>>()
    });
    assert_eq!(left, [vec![1], vec![2, 3, 4, 5]]);
    assert_eq!(store.run(), 2);
}
