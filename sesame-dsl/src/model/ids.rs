//! Typed positions, and the lists they index.

use std::marker::PhantomData;
use std::ops::Index;

/// A typed position in an [`Arena`].
pub trait Id: Copy + Eq + Ord {
    /// The id of a position.
    fn from_index(index: usize) -> Self;
    /// The position.
    fn index(self) -> usize;
}

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(u32);

        impl Id for $name {
            fn from_index(index: usize) -> Self {
                $name(u32::try_from(index).expect("a file has fewer than 2^32 declarations"))
            }
            fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(
    /// A message type of the space.
    MessageId
);
id!(
    /// A topic of the space.
    TopicId
);
id!(
    /// A node of the space.
    NodeId
);
id!(
    /// A metric of the space.
    MetricId
);
id!(
    /// A requirement of the space.
    RequirementId
);
id!(
    /// An operation of the space.
    OperationId
);
id!(
    /// A known test of the space.
    TestId
);
id!(
    /// A campaign of the space.
    CampaignId
);
id!(
    /// A runtime monitor of the space.
    EddiId
);
id!(
    /// A physical lab of the space.
    PhysicalId
);

/// A list whose positions have a type of their own. Iteration is in the order of insertion.
#[derive(Debug, Clone, PartialEq)]
pub struct Arena<I, T> {
    items: Vec<T>,
    ids: PhantomData<I>,
}

impl<I: Id, T> Arena<I, T> {
    /// An empty list.
    pub fn new() -> Self {
        Arena { items: Vec::new(), ids: PhantomData }
    }

    /// Appends an item and returns where it is.
    pub fn push(&mut self, item: T) -> I {
        let id = I::from_index(self.items.len());
        self.items.push(item);
        id
    }

    /// How many items there are.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// All items with their ids.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (I, &T)> + ExactSizeIterator {
        self.items.iter().enumerate().map(|(index, item)| (I::from_index(index), item))
    }

    /// All items.
    pub fn values(&self) -> std::slice::Iter<'_, T> {
        self.items.iter()
    }
}

impl<I: Id, T> Default for Arena<I, T> {
    fn default() -> Self {
        Arena::new()
    }
}

impl<I: Id, T> Index<I> for Arena<I, T> {
    type Output = T;

    fn index(&self, id: I) -> &T {
        &self.items[id.index()]
    }
}
