//! Variables that a host names by their value references, looked up once: hosts name the same ones at every step.

use super::declared::Declared;
use crate::description::BaseType;

/// The Real variables of one call.
#[derive(Debug, Default)]
pub(super) struct Named {
    references: Vec<u32>,
    indices: Vec<usize>,
    /// Whether all are inputs that may be set while the simulation runs.
    are_running_inputs: bool,
}

impl Named {
    /// Takes up the variables behind `references`.
    ///
    /// # Errors
    /// The first reference that no Real variable has; then none is named.
    pub(super) fn look_up(&mut self, references: &[u32], declared: &Declared) -> Result<(), u32> {
        if self.references == references {
            return Ok(());
        }
        self.references.clear();
        self.indices.clear();
        for &reference in references {
            let Some(index) = declared.lookup.index(BaseType::Real, reference) else {
                self.indices.clear();
                return Err(reference);
            };
            self.indices.push(index);
        }
        self.references.extend_from_slice(references);
        self.are_running_inputs = self.indices.iter().all(|index| declared.is_running_input[*index]);
        Ok(())
    }

    /// Their indices, in the order of the references.
    #[inline]
    pub(super) fn indices(&self) -> &[usize] {
        &self.indices
    }

    /// Whether all are inputs that may be set while the simulation runs.
    #[inline]
    pub(super) fn are_running_inputs(&self) -> bool {
        self.are_running_inputs
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::description::{ModelDescription, Variable};

    #[test]
    fn what_is_named_follows_the_references_of_the_last_call() {
        let mut table = ModelDescription::new("Model", "Model");
        table.add(Variable::real("a", 7));
        table.add(Variable::real("b", 5));
        let declared = Declared::of(&Arc::new(table));
        let mut named = Named::default();
        assert_eq!(named.look_up(&[5, 7], &declared), Ok(()));
        assert_eq!(named.indices(), [1, 0]);
        assert_eq!(named.look_up(&[5], &declared), Ok(()));
        assert_eq!(named.indices(), [1]);
        assert_eq!(named.look_up(&[5, 6], &declared), Err(6));
        assert_eq!(named.indices(), [0; 0]);
        // The call before it is not taken for this one.
        assert_eq!(named.look_up(&[5], &declared), Ok(()));
        assert_eq!(named.indices(), [1]);
        assert_eq!(named.look_up(&[], &declared), Ok(()));
        assert_eq!(named.indices(), [0; 0]);
    }
}
