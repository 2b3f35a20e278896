//! What nodes carry, through set operations and motions.
//!
//! *Set operations*, of two solids A and B on one grid: a node of the result that is a node of A has
//! what that carries; else, if it is a node of B, what that carries. Any other node was inside of A and
//! outside of B, or the other way round, and each of its exposed faces is a face of the other's surface
//! from behind: of the directions in which it is exposed, the first whose voxel is a node of that
//! other tells. More than two solids are taken one after the other.
//!
//! *Anything else*: a node has what the node carries that was nearest to the place it comes from.
//!
//! Source: specification (A6, where faces of A keep what is A's, and ties are A's).

use super::ball::{Ball, BallError, balled};
use super::combine::{Operation, combine};
use super::frame::{Frame, FrameError};
use super::links::step;
use super::motion::{Motion, MotionError, Moved, moved};
use super::nearest::Nearest;
use super::painted::{Painted, sides};
use super::{Network, NetworkError, Node};
use crate::payload::{Payload, Value};
use crate::run::Run;
use crate::spans::Spans;
use crate::volume::Volume;

/// A solid whose nodes take what nodes of another carry; `back` tells the place in voxels of the other
/// that a voxel comes from.
pub fn carried(
    solid: Spans,
    from: &Painted,
    back: impl Fn([u32; 3]) -> [f64; 3] + Sync,
    run: &Run,
) -> Result<Painted, NetworkError> {
    let nearest = from.nearest();
    Painted::with(solid, from.payload().kinds(), run, |_, at| nearest.at(back(at)))
}

/// A solid whose nodes take what some nodes of another carry; `back` tells the place in voxels of the
/// other that a voxel comes from.
pub fn told(
    solid: Spans,
    nodes: &[Node],
    payload: &Payload,
    back: impl Fn([u32; 3]) -> [f64; 3] + Sync,
    run: &Run,
) -> Result<Painted, NetworkError> {
    let nearest = Nearest::new(nodes, sides(&solid.placement));
    let value = |n: u32| payload.values().get(n as usize).copied();
    Painted::with(solid, payload.kinds(), run, |_, at| {
        nearest.find(back(at)).and_then(value).unwrap_or(Value::PLAIN)
    })
}

/// Combines solids on one grid, which is that of the first; `None` where there are none or their grids
/// differ in size.
pub fn combine_painted(
    operation: Operation,
    solids: &[Painted],
    run: &Run,
) -> Result<Option<Painted>, NetworkError> {
    let Some((first, others)) = solids.split_first() else { return Ok(None) };
    let mut whole = first.clone();
    for other in others {
        let both = [whole.solid(), other.solid()];
        let Some(solid) = combine(operation, &both, run)? else { return Ok(None) };
        whole = united(solid, [&whole, other], run)?;
    }
    Ok(Some(whole))
}

/// A combination of two solids with what their nodes carry.
fn united(solid: Spans, from: [&Painted; 2], run: &Run) -> Result<Painted, NetworkError> {
    let kinds = from[0].payload().kinds().or(from[1].payload().kinds());
    let values = from.map(Painted::values);
    let at = |at: [u32; 3]| values.iter().find_map(|v| v.at(at));
    let behind = |network: &Network, node: [u32; 3]| {
        let exposed = |&d: &u8| match network.side(node) {
            super::Side::Surface(mask) => mask >> d & 1 == 1,
            _ => false,
        };
        (0..6).filter(exposed).filter_map(|d| step(node, d)).find_map(at)
    };
    Painted::with(solid, kinds, run, |network, node| {
        at(node).or_else(|| behind(network, node)).unwrap_or(Value::PLAIN)
    })
}

/// Brings solids into one grid, as [`super::frame::framed`] does.
pub fn framed_painted(
    operation: Operation,
    solids: Vec<Painted>,
    run: &Run,
) -> Result<Vec<Painted>, FrameError> {
    let spans: Vec<&Spans> = solids.iter().map(Painted::solid).collect();
    let Some(frame) = Frame::new(operation, &spans)? else { return Ok(solids) };
    let bring = |(number, painted): (usize, &Painted)| {
        let (own, back) = frame.bring(painted.solid(), number, run)?;
        Ok(carried(own, painted, |at| back.of(at), run)?)
    };
    let brought = solids.iter().enumerate().map(bring).collect::<Result<_, FrameError>>()?;
    frame.tell(run);
    Ok(brought)
}

/// Moves a solid in the world, as [`super::motion::transformed`] does.
pub fn transformed_painted(
    painted: &Painted,
    motion: &Motion,
    run: &Run,
) -> Result<Painted, MotionError> {
    let Some(plan) = Moved::new(painted.solid(), motion)? else { return Ok(painted.clone()) };
    let Moved { preimage, dims, placement } = plan;
    let solid = moved(painted.network(), &preimage, dims, placement, run)?;
    carried(solid, painted, |at| preimage.place(at), run).map_err(MotionError::from)
}

/// Grows or shrinks a solid, as [`balled`] does.
pub fn balled_painted(painted: &Painted, ball: Ball, run: &Run) -> Result<Painted, BallError> {
    let solid = balled(painted.solid(), ball, run)?;
    // A grown grid is larger by the ball on either side.
    let wider: [f64; 3] =
        std::array::from_fn(|a| (solid.dims()[a] - painted.dims()[a]) as f64 / 2.0);
    let back = |at: [u32; 3]| std::array::from_fn(|a| f64::from(at[a]) - wider[a]);
    Ok(carried(solid, painted, back, run)?)
}

/// The part of a solid in a box of `dims` voxels from `start` on, as [`Spans::framed`] does.
pub fn cut_painted(
    painted: &Painted,
    start: [i64; 3],
    dims: [usize; 3],
    run: &Run,
) -> Result<Painted, NetworkError> {
    let back = |at: [u32; 3]| std::array::from_fn(|a| f64::from(at[a]) + start[a] as f64);
    carried(painted.solid().framed(start, dims), painted, back, run)
}
