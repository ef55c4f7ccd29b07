//! What distinguishes one answer from another, whatever its protocol.

/// The answer that a request calls for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ExpectedReply {
    /// The node that was asked: a different number for every node, below 128.
    pub node: u8,
    /// The request went to the address that every node answers to.
    pub from_any: bool,
    /// What was asked.
    pub command: u8,
    /// Characters of the answer.
    pub characters: u16,
}

/// What an intact answer says of the request that it is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ReplyHeader {
    /// This node answers this command.
    Named {
        /// As in [`ExpectedReply::node`].
        node: u8,
        /// As in [`ExpectedReply::command`].
        command: u8,
    },
    /// It may answer any request.
    Unnamed,
}

impl ExpectedReply {
    /// Before the first request.
    pub(crate) const NONE: ExpectedReply =
        ExpectedReply { node: 0, from_any: false, command: 0, characters: 0 };

    /// Whether an answer with this header may be the expected one.
    #[cfg(feature = "many-nodes")]
    pub(crate) fn fits(&self, header: ReplyHeader) -> bool {
        match header {
            ReplyHeader::Named { node, command } => {
                command == self.command && (self.from_any || node == self.node)
            }
            ReplyHeader::Unnamed => true,
        }
    }

    /// Whether a node's answer that `earlier` called for would pass for this one.
    pub(crate) fn is_confusable_with(&self, earlier: &ExpectedReply) -> bool {
        let node = self.node == earlier.node || self.from_any || earlier.from_any;
        node && self.command == earlier.command
    }
}
