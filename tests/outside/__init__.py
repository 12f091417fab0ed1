"""The product as its users see it: the FMU through importers, the command in a shell."""
