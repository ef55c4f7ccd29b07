//! The worst case: the deepest chain of the main program, and of each level that can interrupt it and the levels below.
//!
//! At worst, every level is interrupted by the next one where it is deepest. Handlers of one level do not interrupt each
//! other, and none of the levels up to the ceiling begins while the ceiling is held. What the core itself puts on the stack
//! for each is added.

use std::collections::{BTreeMap, BTreeSet};

use crate::Error;
use crate::annotations::{Annotations, Level};
use crate::calls::{Graph, find, find_all};
use crate::elf::{Image, THUMB};
use crate::frames::Frame;

/// Bytes the core puts on the stack when an interrupt begins: eight words, and one to align them (PM0214 section 2.3.7).
const EXCEPTION_FRAME: u32 = (8 + 1) * 4;
/// The same with room for the floating-point registers, as soon as anybody has used them.
const FLOATING_EXCEPTION_FRAME: u32 = (26 + 1) * 4;

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
    /// The chain is on a stack of its own, and does not count for the usual one.
    pub own_stack: bool,
}

impl Worst {
    /// Bytes on the usual stack.
    pub fn bytes(&self) -> u32 {
        self.exception_frame + if self.own_stack { 0 } else { length(&self.chain) }
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
    only_handlers_take_stacks(image, frames, annotations)?;
    let floating = frames.values().any(|frame| frame.floating);
    let of_the_core = if floating { FLOATING_EXCEPTION_FRAME } else { EXCEPTION_FRAME };
    let mut deepest = Deepest::new(image, frames, graph, annotations)?;
    let ceilings = ceilings(image, annotations)?;
    // From the highest level down: whatever interrupts a level is known when its turn comes.
    let mut above: Vec<Vec<Worst>> = vec![Vec::new()];
    let main =
        Level { name: "main".to_owned(), handlers: vec![annotations.main.clone()], own_stack_bytes: None };
    for level in annotations.levels.iter().rev().chain([&main]) {
        let interrupting = above.last().cloned().unwrap_or_default();
        let exception_frame = if level.name == main.name { 0 } else { of_the_core };
        let mut candidates = Vec::new();
        for handler in &level.handlers {
            let handler = find(image, handler)?;
            let of = |chain, own_stack| Worst { name: level.name.clone(), exception_frame, chain, own_stack };
            let with = |one: Worst, others: &[Worst]| [&[one], others].concat();
            if let Some(limit) = level.own_stack_bytes {
                let whole = deepest.from(handler, &BTreeSet::new())?;
                let bytes = length(&whole) + total(&interrupting);
                if bytes > limit {
                    let what =
                        format!("`{}` needs {bytes} bytes of its own stack, {limit} are there", level.name);
                    return Err(Error::new(what));
                }
                candidates.push(with(of(whole, true), &interrupting));
                continue;
            }
            // Under the highest ceiling; under the next one, but for what is under the former; and so on; then under none.
            let mut without = BTreeSet::new();
            for ceiling in &ceilings {
                if let Some(free) = above.get(ceiling.above) {
                    candidates.push(with(of(deepest.from(handler, &without)?, false), free));
                    without.extend(&ceiling.held);
                }
            }
            candidates.push(with(of(deepest.from(handler, &without)?, false), &interrupting));
        }
        above.push(candidates.into_iter().max_by_key(|levels| total(levels)).unwrap_or_default());
    }
    Ok(above.pop().unwrap_or_default())
}

fn length(chain: &[Link]) -> u32 {
    chain.iter().map(|link| link.bytes).sum()
}

/// Only the handlers declared so take another stack.
fn only_handlers_take_stacks(
    image: &Image,
    frames: &BTreeMap<u32, Frame>,
    annotations: &Annotations,
) -> Result<(), Error> {
    let own = annotations.levels.iter().filter(|level| level.own_stack_bytes.is_some());
    let own = own.flat_map(|level| &level.handlers).map(|handler| find(image, handler));
    let own = own.collect::<Result<BTreeSet<_>, _>>()?;
    let takers = frames.iter().filter(|(_, frame)| frame.takes_another_stack);
    let mut takers: BTreeSet<u32> = takers.map(|(&address, _)| address).collect();
    for function in &annotations.before_main {
        takers.remove(&find(image, function)?);
    }
    match own.symmetric_difference(&takers).next() {
        None => Ok(()),
        Some(&one) if takers.contains(&one) => {
            Err(Error::new(format!("`{}` takes another stack: whose?", image.name_of(one))))
        }
        Some(&one) => Err(Error::new(format!("`{}` does not take a stack of its own", image.name_of(one)))),
    }
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

/// The ceilings, highest first.
fn ceilings(image: &Image, annotations: &Annotations) -> Result<Vec<Ceiling>, Error> {
    let mut ceilings = Vec::new();
    for line in &annotations.ceilings {
        let mut held = BTreeSet::new();
        for pattern in &line.functions {
            held.extend(find_all(image, pattern)?);
        }
        let above = annotations.levels.iter().rev().position(|level| level.name == line.level);
        let above = above.ok_or_else(|| Error::new(format!("there is no level `{}`", line.level)))?;
        ceilings.push(Ceiling { held, above });
    }
    ceilings.sort_by_key(|ceiling| ceiling.above);
    Ok(ceilings)
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
