"""How is a node tried out that a person has started, at the bench? Nothing here starts a robot or
a node, and nothing leaves a robot moving."""
