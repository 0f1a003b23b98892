//! The codec of one interface.

use std::marker::PhantomData;
use std::sync::Arc;

use sesame_plan::Interface;
use sesame_relay::value::Value;
use sesame_relay::wire::Wanted;

use crate::dialect::Dialect;
use crate::difference::difference;
use crate::error::{CodecError, LayoutError};
use crate::layout::Layout;
use crate::read::{Input, read};
use crate::selection::Selection;
use crate::write::write;

/// Reads and writes the messages of one interface, in one wire format.
#[derive(Debug)]
pub struct Codec<D> {
    layout: Layout,
    selection: Selection,
    dialect: PhantomData<D>,
}

impl<D: Dialect> Codec<D> {
    /// A codec for the interface of this name, which reads what is wanted. Each interface comes after those that it
    /// contains.
    pub fn new(interfaces: &[Interface], name: &str, wanted: &Wanted) -> Result<Self, LayoutError> {
        let layout = Layout::new::<D>(interfaces, name)?;
        let selection = Selection::new(&layout, wanted);
        Ok(Codec { layout, selection, dialect: PhantomData })
    }

    /// Reads a message: a record with the fields that are wanted, which remembers the bytes.
    ///
    /// The whole message is checked: one that is too short or too long is an error, wherever that is.
    pub fn read(&self, message: Arc<[u8]>) -> Result<Value, CodecError> {
        read::<D>(&self.layout, &self.selection, message)
    }

    /// Writes a message. One that was read and not changed is the bytes from which it was read; of a changed one,
    /// everything that was not changed or not read is copied from there. One that was not read is written in the byte
    /// order of most machines, and fields that it lacks are zero or empty.
    ///
    /// Whole numbers beyond the range of their field become its nearest number, reals are rounded to the nearest one
    /// that their field holds, and a list ends where its type does.
    pub fn write(&self, message: &Value) -> Result<Arc<[u8]>, CodecError> {
        write::<D>(&self.layout, &self.selection, message)
    }

    /// Where a layout that others have differs from this one, in a phrase. The number in headers makes no difference.
    pub fn difference(&self, interfaces: &[Interface], name: &str) -> Option<String> {
        match Layout::new::<D>(interfaces, name) {
            Ok(other) => difference(&self.layout, &other),
            Err(error) => Some(error.to_string()),
        }
    }

    /// Whether these bytes are a message of this layout.
    pub fn check(&self, message: &[u8]) -> Result<(), CodecError> {
        let mut input = Input::<D>::new(message)?;
        input.skip_structure(&self.layout, self.layout.message())?;
        input.end()
    }
}
