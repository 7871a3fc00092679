"""The slider-crank of chapter 4: equations by hand, which its system file is compared with."""
