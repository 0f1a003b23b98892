//! State of an operation that each wire of its topic has for itself.

/// The state of an operation per wire of its topic, by the wire's position in the topic.
#[derive(Debug)]
pub struct PerWire<T>(Vec<T>);

impl<T> Default for PerWire<T> {
    fn default() -> Self {
        PerWire(Vec::new())
    }
}

impl<T: Default> PerWire<T> {
    /// The state for a wire; initially the default.
    pub fn entry(&mut self, member: u64) -> &mut T {
        let at = usize::try_from(member).expect("a topic has fewer wires than memory has places");
        if at >= self.0.len() {
            self.0.resize_with(at + 1, T::default);
        }
        &mut self.0[at]
    }
}
