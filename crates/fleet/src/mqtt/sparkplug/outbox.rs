//! What is to be sent on a connection, in its order, and what of it the broker has.
//!
//! Sparkplug wants its data with QoS 0, which no broker confirms. A broker takes the packets of a client in their order: an
//! UNSUBSCRIBE from a topic to which there is no subscription, behind the data, is answered (MQTT 3.1.1, section 3.10.4) when
//! all that was sent before has arrived. It is the *barrier* here.

use std::collections::VecDeque;

use rumqttc::{AsyncClient, QoS};

use crate::mqtt::WINDOW;

/// What is to be sent.
enum Item {
    Data {
        topic: String,
        payload: Vec<u8>,
    },
    /// All numbers below this one were sent before.
    Barrier(u64),
}

/// What is to be sent on a connection.
pub struct Outbox {
    items: VecDeque<Item>,
    /// Publications that the client was given and has not sent.
    handed: usize,
    /// Barriers that were sent and not answered.
    barriers: VecDeque<u64>,
    /// The highest barrier.
    marked: u64,
    barrier_topic: String,
}

impl Outbox {
    /// Of a new connection; there is no subscription to the topic.
    pub fn new(barrier_topic: String) -> Outbox {
        Outbox { items: VecDeque::new(), handed: 0, barriers: VecDeque::new(), marked: 0, barrier_topic }
    }

    /// Adds a publication.
    pub fn push(&mut self, topic: String, payload: Vec<u8>) {
        self.items.push_back(Item::Data { topic, payload });
    }

    /// All numbers below `sent` are before this place.
    pub fn mark(&mut self, sent: u64) {
        if sent > self.marked {
            self.marked = sent;
            self.items.push_back(Item::Barrier(sent));
        }
    }

    /// Whether everything was handed to the client.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Barriers on their way.
    pub fn unanswered(&self) -> usize {
        self.barriers.len()
    }

    /// Hands over as much as the client's channel takes beside its window. If the client has ended, its event says so.
    pub fn send(&mut self, client: &AsyncClient) {
        while self.handed < usize::from(WINDOW)
            && let Some(item) = self.items.pop_front()
        {
            match item {
                Item::Data { topic, payload } => {
                    let _ = client.try_publish(topic, QoS::AtMostOnce, false, payload);
                    self.handed += 1;
                }
                Item::Barrier(sent) => {
                    let _ = client.try_unsubscribe(&self.barrier_topic);
                    self.barriers.push_back(sent);
                }
            }
        }
    }

    /// The client has sent a publication.
    pub fn sent(&mut self) {
        self.handed = self.handed.saturating_sub(1);
    }

    /// A barrier was answered: all numbers below this one have arrived.
    pub fn answered(&mut self) -> Option<u64> {
        self.barriers.pop_front()
    }
}
