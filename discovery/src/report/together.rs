//! The same said of several cables, said once.

use super::grammar::join;
use super::place::Place;

/// Phrases, each with its place; those that are alike but for the number of the cable at their end are one, where the first of them is:
/// `Coulomb friction on winches 1, 2 and 4`.
pub(super) fn together(phrases: impl IntoIterator<Item = (String, Place)>) -> Vec<String> {
    let mut all: Vec<(String, Option<String>, Vec<usize>)> = Vec::new();
    for (phrase, place) in phrases {
        let ending = place.phrase();
        let of_cable = match (phrase.strip_suffix(&ending), place) {
            (Some(beginning), Place::Part(part, Some(cable))) => {
                Some((format!("{beginning}{} {}", part.preposition(), part.plural()), cable))
            }
            _ => None,
        };
        let Some((several, cable)) = of_cable else {
            all.push((phrase, None, Vec::new()));
            continue;
        };
        match all.iter_mut().find(|(_, known, _)| known.as_ref() == Some(&several)) {
            Some((_, _, cables)) => cables.push(cable),
            None => all.push((phrase, Some(several), vec![cable])),
        }
    }
    let said = |(phrase, several, mut cables): (String, Option<String>, Vec<usize>)| match several {
        Some(several) if cables.len() > 1 => {
            cables.sort_unstable();
            let numbers: Vec<String> = cables.iter().map(usize::to_string).collect();
            format!("{several}\u{a0}{}", join(&numbers, "and"))
        }
        _ => phrase,
    };
    all.into_iter().map(said).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_several_winches_have_is_said_once() {
        let phrases = [
            ("Coulomb friction on winch\u{a0}4", "winch[4]"),
            ("drag on the platform", "platform"),
            ("Coulomb friction on winch\u{a0}2", "winch[2]"),
            ("capstan loss on winch\u{a0}1", "winch[1]"),
            ("Coulomb friction on all winches", "winch"),
        ];
        let said = together(phrases.map(|(phrase, place)| (phrase.to_owned(), Place::parse(place))));
        let expected = [
            "Coulomb friction on winches\u{a0}2 and 4",
            "drag on the platform",
            "capstan loss on winch\u{a0}1",
            "Coulomb friction on all winches",
        ];
        assert_eq!(said, expected);
    }

    /// What is not at the end of its phrase stays as it is.
    #[test]
    fn a_phrase_that_says_its_place_elsewhere_stays() {
        let phrase = "Coulomb friction on winch\u{a0}3 or drag".to_owned();
        let said = together([(phrase.clone(), Place::parse("winch[3]")), (phrase.clone(), Place::parse("winch[3]"))]);
        assert_eq!(said, [phrase.clone(), phrase]);
    }
}
