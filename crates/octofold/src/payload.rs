//! What the surface voxels of a solid carry beside their place: labels, colours or both.
//!
//! A payload has one value for each node of a network, in the order of its nodes: by z, y and x. What
//! becomes of values in set operations, motions and files is told in `network::painted` and
//! `network::carry`.

/// What one node carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Value {
    /// Its label; 0 for none.
    pub label: u32,
    /// Its colour, sRGB with straight alpha.
    pub colour: [u8; 4],
}

impl Value {
    /// What a node carries of which nothing is known: no label, and the gray of plain materials.
    pub const PLAIN: Self = Self { label: 0, colour: [204, 204, 204, 255] };
}

/// Which columns a payload has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub struct Kinds {
    /// Labels.
    pub labels: bool,
    /// Colours.
    pub colours: bool,
}

impl Kinds {
    /// True where there is neither.
    pub fn is_none(self) -> bool {
        self == Self::default()
    }

    /// What either has.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self { labels: self.labels || other.labels, colours: self.colours || other.colours }
    }

    /// A value without what is not among these kinds.
    pub fn of(self, value: Value) -> Value {
        Value {
            label: if self.labels { value.label } else { Value::PLAIN.label },
            colour: if self.colours { value.colour } else { Value::PLAIN.colour },
        }
    }
}

/// One value for each node of a network.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Payload {
    kinds: Kinds,
    values: Vec<Value>,
}

impl Payload {
    /// Values in the order of the nodes; what is not among the kinds is left out.
    pub fn new(kinds: Kinds, mut values: Vec<Value>) -> Self {
        values.iter_mut().for_each(|value| *value = kinds.of(*value));
        Self { kinds, values }
    }

    /// Which columns there are.
    pub fn kinds(&self) -> Kinds {
        self.kinds
    }

    /// The values, in the order of the nodes.
    pub fn values(&self) -> &[Value] {
        &self.values
    }
}
