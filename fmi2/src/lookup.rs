//! From value references to places in the table.

use crate::description::{BaseType, ModelDescription};

/// Value references of each base type, sorted, with the index of the variable.
#[derive(Debug)]
pub(crate) struct Lookup {
    of_type: [Vec<(u32, usize)>; 4],
}

impl Lookup {
    pub(crate) fn new(table: &ModelDescription) -> Self {
        let mut of_type: [Vec<(u32, usize)>; 4] = Default::default();
        for (index, variable) in table.variables.iter().enumerate() {
            of_type[variable.base_type() as usize].push((variable.value_reference, index));
        }
        for list in &mut of_type {
            list.sort_unstable();
        }
        Self { of_type }
    }

    /// Index of the variable with this base type and value reference.
    pub(crate) fn index(&self, base: BaseType, reference: u32) -> Option<usize> {
        let list = &self.of_type[base as usize];
        let first = list.first()?.0;
        // References are mostly numbered without gaps, so the place is known before searching.
        let guess = reference.checked_sub(first)? as usize;
        if let Some(&(found, index)) = list.get(guess)
            && found == reference
        {
            return Some(index);
        }
        let place = list.binary_search_by_key(&reference, |entry| entry.0).ok()?;
        Some(list[place].1)
    }

    /// How many variables of this base type there are.
    pub(crate) fn count(&self, base: BaseType) -> usize {
        self.of_type[base as usize].len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Variable;

    #[test]
    fn finds_what_is_there_and_nothing_else() {
        let mut table = ModelDescription::new("Model", "Model");
        for (name, reference) in [("a", 7), ("b", 5), ("c", 6), ("d", 100), ("e", u32::MAX)] {
            table.add(Variable::real(name, reference));
        }
        table.add(Variable::boolean("f", 3));
        let lookup = Lookup::new(&table);
        for (index, variable) in table.variables.iter().enumerate() {
            let found = lookup.index(variable.base_type(), variable.value_reference);
            assert_eq!(found, Some(index));
        }
        for missing in [0, 4, 8, 99, 101, u32::MAX - 1] {
            assert_eq!(lookup.index(BaseType::Real, missing), None);
        }
        assert_eq!(lookup.index(BaseType::Integer, 5), None);
        assert_eq!(lookup.count(BaseType::Real), 5);
    }
}
