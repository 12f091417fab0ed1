//! From value references to places in the table.

use crate::description::{BaseType, ModelDescription};

/// Value references below this are looked up by their number.
const DENSE: usize = 1 << 14;
/// No variable.
const NOTHING: u32 = u32::MAX;

/// The variables of each base type by value reference.
#[derive(Debug)]
pub(crate) struct Lookup {
    of_type: [OfType; 4],
}

#[derive(Debug, Default)]
struct OfType {
    /// Index of the variable for each small reference, as far as there are any.
    dense: Vec<u32>,
    /// The others, sorted, with the index of the variable.
    sparse: Vec<(u32, usize)>,
    count: usize,
}

impl Lookup {
    pub(crate) fn new(table: &ModelDescription) -> Self {
        let mut of_type: [OfType; 4] = Default::default();
        for (index, variable) in table.variables.iter().enumerate() {
            let list = &mut of_type[variable.base_type() as usize];
            let reference = variable.value_reference;
            list.count += 1;
            match (usize::try_from(reference), u32::try_from(index)) {
                (Ok(place), Ok(index)) if place < DENSE && index != NOTHING => {
                    if list.dense.len() <= place {
                        list.dense.resize(place + 1, NOTHING);
                    }
                    list.dense[place] = index;
                }
                _ => list.sparse.push((reference, index)),
            }
        }
        for list in &mut of_type {
            list.sparse.sort_unstable();
        }
        Self { of_type }
    }

    /// Index of the variable with this base type and value reference.
    #[inline]
    pub(crate) fn index(&self, base: BaseType, reference: u32) -> Option<usize> {
        let list = &self.of_type[base as usize];
        match list.dense.get(reference as usize) {
            Some(&index) if index != NOTHING => Some(index as usize),
            _ => {
                let place = list.sparse.binary_search_by_key(&reference, |entry| entry.0).ok()?;
                Some(list.sparse[place].1)
            }
        }
    }

    /// How many variables of this base type there are.
    pub(crate) fn count(&self, base: BaseType) -> usize {
        self.of_type[base as usize].count
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
