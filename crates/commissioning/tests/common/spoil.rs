//! A node that shows a fault at one place of a conversation.

use clino_sim::node::{Burst, Heard, Node, Ns};

/// What happens to an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It does not come.
    Lost,
    /// One byte is changed.
    Byte { index: usize, mask: u8 },
    /// It ends after this many bytes.
    Cut(usize),
    /// It comes so much later.
    Late(Ns),
    /// It comes twice.
    Twice,
}

/// What is spoilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spoil {
    Nothing,
    /// The answer of that number, from 0.
    Answer(usize, Fault),
    /// That answer and all after it.
    AnswersFrom(usize, Fault),
    /// The character heard of that number, from 0, by the mask.
    Heard(usize, u8),
}

pub struct Spoiler<N> {
    pub node: N,
    pub spoil: Spoil,
    answers: usize,
    heard: usize,
}

impl<N> Spoiler<N> {
    pub fn new(node: N, spoil: Spoil) -> Self {
        Spoiler { node, spoil, answers: 0, heard: 0 }
    }
}

fn strike(mut burst: Burst, fault: Fault) -> Option<Burst> {
    match fault {
        Fault::Lost => return None,
        Fault::Byte { index, mask } => {
            let index = index % burst.bytes.len();
            burst.bytes[index] ^= mask;
        }
        Fault::Cut(length) => {
            burst.bytes.truncate(length);
            if burst.bytes.is_empty() {
                return None;
            }
        }
        Fault::Late(by) => {
            burst.drive_at += by;
            burst.start_at += by;
        }
        Fault::Twice => burst.bytes = burst.bytes.repeat(2),
    }
    Some(burst)
}

impl<N: Node> Node for Spoiler<N> {
    fn baud(&self) -> u32 {
        self.node.baud()
    }

    fn hear(&mut self, mut heard: Heard) {
        if let Spoil::Heard(number, mask) = self.spoil
            && number == self.heard
        {
            heard.byte ^= mask;
        }
        self.heard += 1;
        self.node.hear(heard);
    }

    fn next_event(&self) -> Option<Ns> {
        self.node.next_event()
    }

    fn act(&mut self, now: Ns) -> Option<Burst> {
        let burst = self.node.act(now)?;
        let number = self.answers;
        self.answers += 1;
        match self.spoil {
            Spoil::Answer(which, fault) if which == number => strike(burst, fault),
            Spoil::AnswersFrom(first, fault) if first <= number => strike(burst, fault),
            _ => Some(burst),
        }
    }

    fn deaf_while_sending(&self) -> bool {
        self.node.deaf_while_sending()
    }

    fn power_off(&mut self, now: Ns) {
        self.node.power_off(now);
    }

    fn power_on(&mut self, now: Ns) {
        self.node.power_on(now);
    }

    fn line_level(&mut self, now: Ns, high: bool) {
        self.node.line_level(now, high);
    }
}
