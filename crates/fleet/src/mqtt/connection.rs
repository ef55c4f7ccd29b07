//! The connection to the broker: sends what the queue has, and begins anew when it is lost.

use std::collections::{BTreeMap, HashMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use rumqttc::{AsyncClient, Event, MqttOptions, Outgoing as Sent, Packet, QoS};
use tokio::sync::mpsc;
use tokio::task::block_in_place;
use tokio::time::{MissedTickBehavior, interval, sleep_until, timeout};

use super::WINDOW;
use crate::health::BridgeHealth;
use crate::queue::{self, Queue, TICK};
use crate::say::say;
use crate::store::Message;

/// What a translator hands over.
#[derive(Clone, Debug)]
pub enum Outgoing {
    /// Waits for the broker, on disk if need be.
    Kept(Message),
    /// The broker keeps the last one of a topic; so is it sent again after a connection was lost.
    Retained(Message),
    /// Is of no use later: it is sent now or never.
    Live(Message),
}

/// How a connection ends for good.
pub struct Closing {
    /// Sent last, then it is disconnected.
    pub last: Message,
}

/// A connection.
pub struct Connection {
    /// How to reach the broker.
    pub options: MqttOptions,
    /// What is sent first of all on every connection.
    pub first: Message,
    /// What waits.
    pub queue: Queue,
    /// What is to be sent.
    pub input: mpsc::UnboundedReceiver<Outgoing>,
    /// Its figures.
    pub health: Arc<BridgeHealth>,
}

/// From one try to connect to the next: the first, and the most it grows to.
const TRY_AGAIN: Duration = Duration::from_millis(500);
const TRY_AGAIN_MOST: Duration = Duration::from_secs(8);
/// How long the last messages may take when the program ends.
const FAREWELL: Duration = Duration::from_secs(2);

/// What becomes of a session.
enum End {
    /// The connection failed.
    Lost(String),
    /// The program ends.
    Closed,
}

impl Connection {
    /// Runs until no more is to be sent: until whoever hands it over has ended.
    pub async fn run(mut self, closing: Closing) {
        let mut retained = BTreeMap::new();
        let mut wait = TRY_AGAIN;
        loop {
            let begun = Instant::now();
            let mut session = Session::new(&self.options, &self.first, &retained);
            let end = session.run(&mut self, &mut retained).await;
            self.health.is_connected.store(false, Ordering::Relaxed);
            match end {
                End::Closed => {
                    session.farewell(&closing.last, &mut self).await;
                    block_in_place(|| queue::close(&mut [&mut self.queue]));
                    return;
                }
                End::Lost(why) => {
                    say(format_args!("broker {}: {why}", self.options.broker_address().0));
                    self.health.lost.fetch_add(1, Ordering::Relaxed);
                }
            }
            drop(session);
            self.queue.rewind();
            if begun.elapsed() > TRY_AGAIN_MOST {
                wait = TRY_AGAIN;
            }
            if self.pause(wait, &mut retained).await {
                block_in_place(|| queue::close(&mut [&mut self.queue]));
                return;
            }
            wait = (wait * 2).min(TRY_AGAIN_MOST);
        }
    }

    /// Takes what comes while there is no connection; returns whether the program ends.
    async fn pause(&mut self, wait: Duration, retained: &mut BTreeMap<String, Message>) -> bool {
        let until = Instant::now() + wait;
        let mut tick = interval(TICK);
        loop {
            tokio::select! {
                () = sleep_until(until.into()) => return false,
                _ = tick.tick() => self.tick(),
                outgoing = self.input.recv() => match outgoing {
                    Some(Outgoing::Kept(message)) => self.queue.push(message, Instant::now()),
                    Some(Outgoing::Retained(message)) => _ = retained.insert(message.topic.clone(), message),
                    Some(Outgoing::Live(_)) => {}
                    None => return true,
                },
            }
        }
    }

    fn tick(&mut self) {
        block_in_place(|| queue::tick(&mut [&mut self.queue], Instant::now()));
        self.health.note(&mut [&mut self.queue]);
    }
}

/// One connection, from the try to its end.
struct Session {
    client: AsyncClient,
    events: mpsc::Receiver<Result<Event, String>>,
    pump: tokio::task::JoinHandle<()>,
    is_connected: bool,
    /// Numbers of messages in the order in which they were handed to the client; `None` if they are not the queue's.
    handed: VecDeque<Option<u64>>,
    /// Numbers of messages by their packet identifier.
    sent: HashMap<u16, u64>,
    /// To be sent before what waits.
    soon: VecDeque<Message>,
}

impl Session {
    fn new(options: &MqttOptions, first: &Message, retained: &BTreeMap<String, Message>) -> Session {
        let (client, events, pump) = super::connect(options.clone(), usize::from(WINDOW) * 2);
        let soon = std::iter::once(first).chain(retained.values()).cloned().collect();
        Session {
            client,
            events,
            pump,
            is_connected: false,
            handed: VecDeque::new(),
            sent: HashMap::new(),
            soon,
        }
    }

    async fn run(&mut self, connection: &mut Connection, retained: &mut BTreeMap<String, Message>) -> End {
        let mut tick = interval(TICK);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            if self.is_connected {
                self.send(&mut connection.queue);
            }
            tokio::select! {
                biased;
                event = self.events.recv() => match event {
                    Some(Ok(event)) => self.take(&event, connection),
                    Some(Err(why)) => return End::Lost(why),
                    None => return End::Lost("the client ended".into()),
                },
                _ = tick.tick() => connection.tick(),
                outgoing = connection.input.recv() => match outgoing {
                    Some(Outgoing::Kept(message)) => connection.queue.push(message, Instant::now()),
                    Some(Outgoing::Retained(message)) => {
                        if retained.insert(message.topic.clone(), message.clone()).as_ref() != Some(&message) {
                            self.soon.push_back(message);
                        }
                    }
                    Some(Outgoing::Live(message)) if self.is_connected => self.soon.push_back(message),
                    Some(Outgoing::Live(_)) => {}
                    None => return End::Closed,
                },
            }
        }
    }

    /// Hands over as much as the window takes.
    fn send(&mut self, queue: &mut Queue) {
        while self.handed.len() + self.sent.len() < usize::from(WINDOW) {
            let (number, message) = match self.soon.pop_front() {
                Some(message) => (None, message),
                None => match queue.send_next() {
                    Some((number, message)) => (Some(number), message),
                    None => return,
                },
            };
            let qos = if number.is_some() || message.retain { QoS::AtLeastOnce } else { QoS::AtMostOnce };
            // The channel is larger than the window. If the client has ended, its event says so.
            let _ = self.client.try_publish(message.topic, qos, message.retain, message.payload);
            self.handed.push_back(number);
        }
    }

    fn take(&mut self, event: &Event, connection: &mut Connection) {
        match event {
            Event::Incoming(Packet::ConnAck(_)) => {
                self.is_connected = true;
                connection.health.is_connected.store(true, Ordering::Relaxed);
            }
            // In the order in which they were handed over; 0 is one that is not confirmed.
            Event::Outgoing(Sent::Publish(packet)) => {
                if let Some(Some(number)) = self.handed.pop_front() {
                    self.sent.insert(*packet, number);
                }
            }
            Event::Incoming(Packet::PubAck(ack)) => {
                if let Some(number) = self.sent.remove(&ack.pkid) {
                    connection.queue.confirm(number);
                    connection.health.confirmed.fetch_add(1, Ordering::Relaxed);
                }
            }
            _ => {}
        }
    }

    /// Sends what the window takes, says that the bridge goes, and disconnects. What is not confirmed by then waits on disk.
    async fn farewell(&mut self, last: &Message, connection: &mut Connection) {
        if !self.is_connected {
            return;
        }
        self.send(&mut connection.queue);
        let client = self.client.clone();
        let said = async {
            let _ = client.publish(&last.topic, QoS::AtLeastOnce, last.retain, last.payload.clone()).await;
            let _ = client.disconnect().await;
            while let Some(Ok(event)) = self.events.recv().await {
                self.take(&event, connection);
                if matches!(event, Event::Outgoing(Sent::Disconnect)) {
                    return;
                }
            }
        };
        // A broker that does not take it has the last will.
        let _ = timeout(FAREWELL, said).await;
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.pump.abort();
    }
}
