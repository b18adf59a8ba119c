"""The simulator esmini, by its library: it moves everybody but an ego that our driver drives."""
