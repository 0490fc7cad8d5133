"""From analysis to design: derivatives of scalar results by keys of scenes and links."""
