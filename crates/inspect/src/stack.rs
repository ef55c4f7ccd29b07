//! The worst case: the deepest chain of the main program, and of each level that can interrupt it and the levels below.
//!
//! At worst, every level is interrupted by the next one where it is deepest. Handlers of one level do not interrupt each
//! other, and none of the levels up to the ceiling begins while the ceiling is held. What the core itself puts on the stack
//! for each is added.

use std::collections::{BTreeMap, BTreeSet};

use crate::Error;
use crate::annotations::Annotations;
use crate::calls::{Graph, find, find_all};
use crate::elf::{Image, THUMB};
use crate::frames::Frame;

/// One function of a chain of calls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// Address of the function.
    pub function: u32,
    /// Bytes it has on the stack where the next one is called; the last one: at most.
    pub bytes: u32,
}

/// The deepest chain of a level.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Worst {
    /// Of the level.
    pub name: String,
    /// Bytes put there by the core before.
    pub exception_frame: u32,
    /// The chain, outermost first.
    pub chain: Vec<Link>,
}

impl Worst {
    /// Bytes of all.
    pub fn bytes(&self) -> u32 {
        self.exception_frame + self.chain.iter().map(|link| link.bytes).sum::<u32>()
    }
}

/// The worst case: a chain of the main program, interrupted by one of a level above, and so on.
pub fn worst(
    image: &Image,
    frames: &BTreeMap<u32, Frame>,
    graph: &Graph,
    annotations: &Annotations,
) -> Result<Vec<Worst>, Error> {
    every_vector_has_a_level(image, annotations)?;
    let mut deepest = Deepest::new(image, frames, graph, annotations)?;
    let ceiling = Ceiling::new(image, annotations)?;
    // From the highest level down: whatever interrupts a level is known when its turn comes.
    let mut above: Vec<Vec<Worst>> = vec![Vec::new()];
    let levels = annotations.levels.iter().rev();
    let levels =
        levels.map(|level| (level.name.as_str(), annotations.exception_frame_bytes, &level.handlers[..]));
    let main = ("main", 0, std::slice::from_ref(&annotations.main));
    for (name, exception_frame, handlers) in levels.chain([main]) {
        let mut candidates = Vec::new();
        for handler in handlers {
            let handler = find(image, handler)?;
            let level = |chain| Worst { name: name.to_owned(), exception_frame, chain };
            let open = level(deepest.from(handler, &ceiling.held)?);
            candidates.push([vec![open], above.last().cloned().unwrap_or_default()].concat());
            if let Some(free) = above.get(ceiling.above) {
                let held = level(deepest.from(handler, &BTreeSet::new())?);
                candidates.push([vec![held], free.clone()].concat());
            }
        }
        above.push(candidates.into_iter().max_by_key(|levels| total(levels)).unwrap_or_default());
    }
    Ok(above.pop().unwrap_or_default())
}

/// Bytes of some levels.
pub fn total(levels: &[Worst]) -> u32 {
    levels.iter().map(Worst::bytes).sum()
}

/// Every handler in the vectors has to be in a level, and the other way round.
fn every_vector_has_a_level(image: &Image, annotations: &Annotations) -> Result<(), Error> {
    // The first is the initial stack pointer, the second the reset.
    let vectors = image.vectors.iter().skip(2).filter(|&&vector| vector != 0);
    let vectors: BTreeSet<u32> = vectors.map(|vector| vector & !THUMB).collect();
    let handlers = annotations.levels.iter().flat_map(|level| &level.handlers);
    let handlers = handlers.map(|handler| find(image, handler)).collect::<Result<BTreeSet<_>, _>>()?;
    if let Some(&vector) = vectors.difference(&handlers).next() {
        return Err(Error::new(format!("which level is the handler `{}` of?", image.name_of(vector))));
    }
    if let Some(&other) = handlers.difference(&vectors).next() {
        return Err(Error::new(format!("no vector leads to the handler `{}`", image.name_of(other))));
    }
    Ok(())
}

/// What holds off interrupts.
struct Ceiling {
    /// While one of these is active, no level up to the ceiling can begin.
    held: BTreeSet<u32>,
    /// How many levels are above.
    above: usize,
}

impl Ceiling {
    fn new(image: &Image, annotations: &Annotations) -> Result<Ceiling, Error> {
        let Some(line) = &annotations.ceiling else {
            return Ok(Ceiling { held: BTreeSet::new(), above: usize::MAX });
        };
        let mut held = BTreeSet::new();
        for pattern in &line.functions {
            held.extend(find_all(image, pattern)?);
        }
        let above = annotations.levels.iter().rev().position(|level| level.name == line.level);
        let above = above.ok_or_else(|| Error::new(format!("there is no level `{}`", line.level)))?;
        Ok(Ceiling { held, above })
    }
}

/// How often each function of which that is bounded is active.
type Uses = Vec<u8>;

/// Looks for the longest ways, and remembers them.
struct Deepest<'a> {
    image: &'a Image,
    frames: &'a BTreeMap<u32, Frame>,
    graph: &'a Graph,
    /// Functions that may be active several times, and how often.
    bounds: Vec<(BTreeSet<u32>, u8)>,
    known: BTreeMap<(u32, Uses), (u32, Vec<Link>)>,
    /// The way to where the search is.
    way: Vec<(u32, Uses)>,
    /// Functions that are left out.
    without: BTreeSet<u32>,
}

impl<'a> Deepest<'a> {
    fn new(
        image: &'a Image,
        frames: &'a BTreeMap<u32, Frame>,
        graph: &'a Graph,
        annotations: &Annotations,
    ) -> Result<Self, Error> {
        let bounds =
            annotations.recursion.iter().map(|line| Ok((find_all(image, &line.function)?, line.at_most)));
        let bounds = bounds.collect::<Result<Vec<_>, Error>>()?;
        let (known, way, without) = Default::default();
        Ok(Deepest { image, frames, graph, bounds, known, way, without })
    }

    /// The deepest chain from a function, as if some others were not there.
    fn from(&mut self, function: u32, without: &BTreeSet<u32>) -> Result<Vec<Link>, Error> {
        if self.without != *without {
            self.known.clear();
            self.without = without.clone();
        }
        let uses = vec![0; self.bounds.len()];
        Ok(self.below(function, uses)?.map(|(_, chain)| chain).unwrap_or_default())
    }

    /// Bytes and chain; `None` if the function is left out, or active as often as it may be already.
    fn below(&mut self, function: u32, mut uses: Uses) -> Result<Option<(u32, Vec<Link>)>, Error> {
        if self.without.contains(&function) {
            return Ok(None);
        }
        for ((bounded, at_most), uses) in self.bounds.iter().zip(&mut uses) {
            if bounded.contains(&function) {
                if uses == at_most {
                    return Ok(None);
                }
                *uses += 1;
            }
        }
        let state = (function, uses);
        if let Some(known) = self.known.get(&state) {
            return Ok(Some(known.clone()));
        }
        if let Some(begin) = self.way.iter().position(|seen| *seen == state) {
            let names = self.way.iter().skip(begin).map(|(function, _)| self.image.name_of(*function));
            let cycle: Vec<String> = names.chain([self.image.name_of(function)]).collect();
            return Err(Error::new(format!("recursion without a bound: {}", cycle.join(" -> "))));
        }
        self.way.push(state.clone());
        let own = self.frames.get(&function).map_or(0, |frame| frame.size);
        let mut worst = (own, vec![Link { function, bytes: own }]);
        let graph = self.graph;
        for edge in graph.get(&function).into_iter().flatten() {
            let Some((bytes, chain)) = self.below(edge.to, state.1.clone())? else { continue };
            if edge.depth + bytes > worst.0 {
                let here = Link { function, bytes: edge.depth };
                worst = (edge.depth + bytes, [here].into_iter().chain(chain).collect());
            }
        }
        self.way.pop();
        self.known.insert(state, worst.clone());
        Ok(Some(worst))
    }
}
