//! The tree of transforms, groups and shapes.

use super::FORMAT;
use super::chunks::{Cursor, Dict};
use crate::{At, ReadError};
use octofold::{Finding, Run};
use std::collections::{BTreeMap, BTreeSet};

/// Nodes by their numbers, and the layers that are hidden.
#[derive(Default)]
pub(super) struct Scene {
    nodes: BTreeMap<u32, Node>,
    hidden_layers: BTreeSet<u32>,
}

enum Node {
    Transform { child: u32, layer: u32, hidden: bool, frames: u32, pose: Pose },
    Group { children: Vec<u32>, hidden: bool },
    Shape { models: Vec<u32>, hidden: bool },
}

/// A turn by quarter turns and flips, then a move by whole voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    /// For each row of the matrix, the column that is not 0.
    columns: [usize; 3],
    /// For each row, the sign.
    signs: [i64; 3],
    /// The move.
    shift: [i64; 3],
}

impl Pose {
    const IDENTITY: Self = Self { columns: [0, 1, 2], signs: [1; 3], shift: [0; 3] };

    /// The pose that puts the low corner of a model at the world's origin.
    pub(super) fn corner(size: [u32; 3]) -> Self {
        Self { shift: pivot(size), ..Self::IDENTITY }
    }

    /// This pose of everything in the pose `inner`.
    fn of(&self, inner: &Self) -> Self {
        Self {
            columns: self.columns.map(|c| inner.columns[c]),
            signs: std::array::from_fn(|r| self.signs[r] * inner.signs[self.columns[r]]),
            shift: std::array::from_fn(|r| {
                self.signs[r] * inner.shift[self.columns[r]] + self.shift[r]
            }),
        }
    }

    /// The world's voxel for a voxel of a model.
    pub(super) fn place(&self, voxel: [i64; 3], size: [u32; 3]) -> [i64; 3] {
        let pivot = pivot(size);
        std::array::from_fn(|r| {
            let c = self.columns[r];
            let from_pivot = voxel[c] - pivot[c];
            // The voxel as a unit cube: flipped, its high side becomes the low one.
            self.shift[r] + if self.signs[r] > 0 { from_pivot } else { -from_pivot - 1 }
        })
    }

    /// First voxel, and one past the last, of a model's box in the world.
    pub(super) fn bounds(&self, size: [u32; 3]) -> ([i64; 3], [i64; 3]) {
        let a = self.place([0; 3], size);
        let b = self.place(size.map(|n| i64::from(n) - 1), size);
        let low = std::array::from_fn(|i| a[i].min(b[i]));
        (low, std::array::from_fn(|i| a[i].max(b[i]) + 1))
    }

    /// Reads the attributes of a frame.
    fn parse(frame: &Dict<'_>) -> Option<Self> {
        let mut pose = Self::IDENTITY;
        if let Some(text) = frame.get("_r") {
            let bits: u8 = text.trim().parse().ok()?;
            let [a, b] = [usize::from(bits & 3), usize::from(bits >> 2 & 3)];
            if a == b || a == 3 || b == 3 {
                return None;
            }
            pose.columns = [a, b, 3 - a - b];
            pose.signs = std::array::from_fn(|r| if bits >> (4 + r) & 1 == 1 { -1 } else { 1 });
        }
        if let Some(text) = frame.get("_t") {
            let mut parts = text.split_whitespace().map(|part| part.parse::<i32>());
            for shift in &mut pose.shift {
                *shift = parts.next()?.ok()?.into();
            }
        }
        Some(pose)
    }
}

/// The voxel whose low corner a model turns about.
pub(super) fn pivot(size: [u32; 3]) -> [i64; 3] {
    size.map(|n| i64::from(n / 2))
}

fn is_hidden(attributes: &Dict<'_>) -> bool {
    attributes.get("_hidden") == Some("1")
}

impl Scene {
    pub(super) fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    pub(super) fn transform(&mut self, mut content: Cursor<'_>) -> Result<(), ReadError> {
        let id = content.u32()?;
        let hidden = is_hidden(&content.dict()?);
        let child = content.u32()?;
        content.u32()?;
        let layer = content.u32()?;
        let frames = content.u32()?;
        let mut pose = Pose::IDENTITY;
        if frames > 0 {
            let at = content.clone();
            pose = Pose::parse(&content.dict()?).ok_or_else(|| {
                at.malformed(format!("rotation or translation of node {id} is damaged"))
            })?;
        }
        self.nodes.insert(id, Node::Transform { child, layer, hidden, frames, pose });
        Ok(())
    }

    pub(super) fn group(&mut self, mut content: Cursor<'_>) -> Result<(), ReadError> {
        let id = content.u32()?;
        let hidden = is_hidden(&content.dict()?);
        let count = content.u32()?;
        let mut children = Vec::new();
        for _ in 0..count {
            children.push(content.u32()?);
        }
        self.nodes.insert(id, Node::Group { children, hidden });
        Ok(())
    }

    pub(super) fn shape(&mut self, mut content: Cursor<'_>) -> Result<(), ReadError> {
        let id = content.u32()?;
        let hidden = is_hidden(&content.dict()?);
        let count = content.u32()?;
        let mut models = Vec::new();
        for _ in 0..count {
            models.push(content.u32()?);
            content.dict()?;
        }
        self.nodes.insert(id, Node::Shape { models, hidden });
        Ok(())
    }

    pub(super) fn layer(&mut self, mut content: Cursor<'_>) -> Result<(), ReadError> {
        let id = content.u32()?;
        if is_hidden(&content.dict()?) {
            self.hidden_layers.insert(id);
        }
        Ok(())
    }

    /// Model numbers and poses of all visible shapes, in the order of the tree.
    pub(super) fn walk(&self, run: &Run) -> Result<Vec<(u32, Pose)>, ReadError> {
        let malformed = |fact| ReadError::malformed(FORMAT, At::File, fact);
        let mut shapes = Vec::new();
        let mut seen = BTreeSet::new();
        let (mut skipped, mut animated) = (0u64, 0u64);
        let root = self.nodes.keys().next().copied().unwrap_or(0);
        let mut waiting = vec![(root, Pose::IDENTITY)];
        while let Some((id, pose)) = waiting.pop() {
            // A node with two parents, or below itself, would be met again.
            if !seen.insert(id) {
                return Err(malformed(format!("the scene is no tree: node {id} is met twice")));
            }
            let node = self.nodes.get(&id);
            match node.ok_or_else(|| malformed(format!("the scene has no node {id}")))? {
                Node::Transform { layer, hidden, .. }
                    if *hidden || self.hidden_layers.contains(layer) =>
                {
                    skipped += 1;
                }
                Node::Group { hidden: true, .. } | Node::Shape { hidden: true, .. } => {
                    skipped += 1;
                }
                Node::Transform { child, frames, pose: inner, .. } => {
                    animated += u64::from(*frames > 1);
                    waiting.push((*child, pose.of(inner)));
                }
                Node::Group { children, .. } => {
                    waiting.extend(children.iter().rev().map(|&child| (child, pose)));
                }
                Node::Shape { models, .. } => {
                    animated += u64::from(models.len() > 1);
                    shapes.extend(models.first().map(|&model| (model, pose)));
                }
            }
        }
        if skipped > 0 {
            let text = format!("{skipped} hidden parts of the scene were left out");
            run.finding(Finding::note("hidden-nodes", text).of(skipped));
        }
        if animated > 0 {
            let text = format!("{animated} parts of the scene move: their first frame was read");
            run.finding(Finding::warning("first-frame", text).of(animated));
        }
        Ok(shapes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_follow_each_other() {
        let size = [3, 4, 5];
        let a = Pose { columns: [1, 2, 0], signs: [1, -1, -1], shift: [7, -2, 4] };
        let b = Pose { columns: [0, 2, 1], signs: [-1, 1, -1], shift: [1, 5, -3] };
        // Poses act on the cube from (v - pivot) to one further; its doubled middle is exact.
        let act = |pose: &Pose, v: [i64; 3]| -> [i64; 3] {
            std::array::from_fn(|r| pose.signs[r] * v[pose.columns[r]] + 2 * pose.shift[r])
        };
        for voxel in [[0, 0, 0], [2, 3, 4], [1, 0, 3]] {
            let middle: [i64; 3] = std::array::from_fn(|i| 2 * (voxel[i] - pivot(size)[i]) + 1);
            let expected = act(&a, act(&b, middle)).map(|v| (v - 1) / 2);
            assert_eq!(a.of(&b).place(voxel, size), expected);
        }
    }

    #[test]
    fn corners_are_put_at_the_origin() {
        assert_eq!(Pose::corner([3, 4, 5]).bounds([3, 4, 5]), ([0; 3], [3, 4, 5]));
    }
}
