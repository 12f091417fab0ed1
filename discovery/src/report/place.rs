//! Places of `discovery.json` in words.

/// A place, read from its string.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// The platform, or one axis of it: `force_x`, `force_y`, `torque`.
    Platform(Option<Axis>),
    /// A part that belongs to one cable, counted from 1, or to all of them.
    Part(Part, Option<usize>),
    /// A sensor by its channel; the cable where it has one.
    Sensor(String, Option<usize>),
    /// Anything else, kept as written.
    Other(String),
}

/// Axis of the wrench on the platform.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    ForceX,
    ForceY,
    Torque,
}

/// What belongs to one cable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Winch,
    Cable,
    Anchor,
    Attachment,
}

impl Place {
    /// Reads `winch[3]`, `platform.force_x`, `sensor.cable_length[1]`, ...
    pub(super) fn parse(text: &str) -> Place {
        if let Some(channel) = text.strip_prefix("sensor.") {
            let (name, index) = split_index(channel);
            return Place::Sensor(name.to_owned(), index);
        }
        let (name, index) = split_index(text);
        match name {
            "platform" => Place::Platform(None),
            "platform.force_x" => Place::Platform(Some(Axis::ForceX)),
            "platform.force_y" => Place::Platform(Some(Axis::ForceY)),
            "platform.torque" => Place::Platform(Some(Axis::Torque)),
            "winch" => Place::Part(Part::Winch, index),
            "cable" => Place::Part(Part::Cable, index),
            "anchor" => Place::Part(Part::Anchor, index),
            "attachment" => Place::Part(Part::Attachment, index),
            _ => Place::Other(text.to_owned()),
        }
    }

    /// As a noun: `winch 3`, `platform, force along x`, `sensor of cable length 1`.
    pub(super) fn noun(&self) -> String {
        match self {
            Place::Platform(None) => "platform".to_owned(),
            Place::Platform(Some(Axis::ForceX)) => "platform, force along x".to_owned(),
            Place::Platform(Some(Axis::ForceY)) => "platform, force along y".to_owned(),
            Place::Platform(Some(Axis::Torque)) => "platform, torque".to_owned(),
            Place::Part(part, Some(i)) => format!("{}\u{a0}{i}", part.noun()),
            Place::Part(part, None) => format!("all {}", part.plural()),
            Place::Sensor(name, Some(i)) => format!("sensor of {}\u{a0}{i}", words(name)),
            Place::Sensor(name, None) => format!("sensor of {}", words(name)),
            Place::Other(text) => text.clone(),
        }
    }

    /// As the end of a sentence: `on winch 3`, `on the platform along x`, `in the measured cable length 1`.
    pub(super) fn phrase(&self) -> String {
        match self {
            Place::Platform(None) => "on the platform".to_owned(),
            Place::Platform(Some(Axis::ForceX)) => "on the platform along x".to_owned(),
            Place::Platform(Some(Axis::ForceY)) => "on the platform along y".to_owned(),
            Place::Platform(Some(Axis::Torque)) => "on the platform's rotation".to_owned(),
            Place::Part(part, Some(i)) => {
                format!("{} {}\u{a0}{i}", part.preposition(), part.noun())
            }
            Place::Part(part, None) => format!("{} all {}", part.preposition(), part.plural()),
            Place::Sensor(name, Some(i)) => format!("in the measured {}\u{a0}{i}", words(name)),
            Place::Sensor(name, None) => format!("in the measured {}", words(name)),
            Place::Other(text) => format!("at {text}"),
        }
    }

    /// What an unknown effect here would be: `a force on the platform along x`, `a force at winch 3`.
    pub(super) fn unknown(&self) -> String {
        match self {
            Place::Platform(Some(Axis::ForceX)) => "a force on the platform along x".to_owned(),
            Place::Platform(Some(Axis::ForceY)) => "a force on the platform along y".to_owned(),
            Place::Platform(Some(Axis::Torque)) => "a torque on the platform".to_owned(),
            Place::Platform(None) => "a force or torque on the platform".to_owned(),
            Place::Part(Part::Winch, _) => format!("a force {}", self.phrase()),
            _ => format!("an error {}", self.phrase()),
        }
    }
}

impl Part {
    fn noun(self) -> &'static str {
        match self {
            Part::Winch => "winch",
            Part::Cable => "cable",
            Part::Anchor => "anchor",
            Part::Attachment => "attachment",
        }
    }

    pub(super) fn plural(self) -> &'static str {
        match self {
            Part::Winch => "winches",
            Part::Cable => "cables",
            Part::Anchor => "anchors",
            Part::Attachment => "attachments",
        }
    }

    pub(super) fn preposition(self) -> &'static str {
        match self {
            Part::Winch => "on",
            Part::Cable => "in",
            Part::Anchor | Part::Attachment => "at",
        }
    }
}

/// A signal's FMU name in words: `cable_length[1]` as `cable length 1`, `x` as `position x`.
pub(crate) fn channel_words(channel: &str) -> String {
    let (name, index) = split_index(channel);
    match index {
        Some(i) => format!("{}\u{a0}{i}", words(name)),
        None => words(name),
    }
}

/// The name for people of a signal: the one used wherever it is shown.
fn words(name: &str) -> String {
    match name {
        "phi" => "rotation φ".to_owned(),
        "x" | "y" => format!("position {name}"),
        "vx" => "speed along x".to_owned(),
        "vy" => "speed along y".to_owned(),
        "omega" => "angular rate".to_owned(),
        "unstretched_length_rate" => "reel-out speed".to_owned(),
        _ => name.replace('_', " "),
    }
}

fn split_index(text: &str) -> (&str, Option<usize>) {
    text.strip_suffix(']')
        .and_then(|rest| rest.split_once('['))
        .and_then(|(name, index)| Some((name, Some(index.parse().ok()?))))
        .unwrap_or((text, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_the_contract_read_well() {
        let cases = [
            ("platform.force_x", "platform, force along x", "on the platform along x"),
            ("platform.torque", "platform, torque", "on the platform's rotation"),
            ("winch[3]", "winch\u{a0}3", "on winch\u{a0}3"),
            ("winch", "all winches", "on all winches"),
            ("cable[2]", "cable\u{a0}2", "in cable\u{a0}2"),
            ("sensor.cable_length[1]", "sensor of cable length\u{a0}1", "in the measured cable length\u{a0}1"),
            ("sensor.pose", "sensor of pose", "in the measured pose"),
            ("gearbox[x]", "gearbox[x]", "at gearbox[x]"),
        ];
        for (text, noun, phrase) in cases {
            let place = Place::parse(text);
            assert_eq!(place.noun(), noun);
            assert_eq!(place.phrase(), phrase);
        }
    }

    #[test]
    fn channels_read_well() {
        assert_eq!(channel_words("cable_length[3]"), "cable length\u{a0}3");
        assert_eq!(channel_words("phi"), "rotation φ");
        assert_eq!(channel_words("unstretched_length_rate[2]"), "reel-out speed\u{a0}2");
    }
}
