"""How far published angles are behind the arm."""
