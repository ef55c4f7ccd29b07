//! What is sent to the gateway, and when.

use clino_sim::node::Ns;

use crate::gaps::Gap;

/// Something that is sent to the gateway.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Planned<'a, T: ?Sized> {
    /// When.
    pub at: Ns,
    /// What.
    pub what: &'a T,
    /// Pauses in it.
    pub gaps: Vec<Gap>,
}

/// The same in the order in which it is sent.
pub(super) fn in_order<'a, T: ?Sized + 'a>(
    planned: impl Iterator<Item = Planned<'a, T>>,
) -> impl Iterator<Item = Planned<'a, T>> {
    let mut planned: Vec<_> = planned.collect();
    planned.sort_by_key(|planned| planned.at);
    planned.into_iter()
}
