"""How does a node read the keyboard and the mouse of this computer?"""
