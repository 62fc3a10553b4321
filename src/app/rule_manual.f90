!> The manual's page on quadrature rules: where a rule leaves deformations without energy.
module rule_manual
  use text, only: to_text
  use spurious_modes, only: n_spurious_modes
  use strain_projection, only: projection_spec_t
  implicit none
  private

  public :: rule_manual_text

  !> A rule: integration points of a direction as the degree plus `more`, in equal parts.
  type :: rule_t
    integer :: more(3) = 0, parts(3) = 1
  end type rule_t

  character(1), parameter :: feed = new_line("a")

contains

  !> Markdown: for each degree and size of patch the modes that rules leave, as the reader of decks
  !! counts them. Takes some seconds.
  function rule_manual_text() result(text)
    character(:), allocatable :: text
    integer, parameter :: degrees(3, 9) = reshape([1, 1, 1, 2, 1, 2, 2, 2, 1, 2, 2, 2, 3, 2, 2, &
                                                   3, 3, 2, 3, 3, 3, 4, 4, 2, 4, 4, 3], [3, 9])
    integer, parameter :: sizes(3, 4) = reshape([1, 1, 1, 2, 1, 1, 2, 2, 1, 2, 2, 2], [3, 4])
    integer :: d, s

    text = introduction()
    do d = 1, size(degrees, 2)
      do s = 1, size(sizes, 2)
        text = text//row(degrees(:, d), sizes(:, s))
      end do
    end do
  end function rule_manual_text

  function introduction() result(text)
    character(:), allocatable :: text

    text = "# Quadrature rules"//feed// &
      feed// &
      "This page is what `igaform --rules` prints. It counts the deformations of "// &
      "a patch that a rule"//feed// &
      "does not see, by the eigenvalues of the stiffness that the force routine "// &
      "gives: those without"//feed// &
      "energy beside the six rigid motions. The reader of decks counts in the "// &
      "same way, with the"//feed// &
      "deck's own degrees, elements, rule and projection; it refuses a rule that "// &
      "leaves any and names"//feed// &
      "the nearest one that leaves none."//feed// &
      feed// &
      "`n` stands for two elements or more: longer rows add none of another "// &
      "kind. `REDUCED` has as many"//feed// &
      "points as the degree p in each direction. The other columns change that "// &
      "along single axes: one"//feed// &
      "point more through the thickness; p points in each of its halves "// &
      "(`RULE=""2,2,2x2""` for p = 2);"//feed// &
      "one point more across; one less along beside one more through the "// &
      "thickness. `FULL` leaves none"//feed// &
      "on any patch. Supports hold some of these modes; contact and loads excite "// &
      "the others."//feed// &
      feed// &
      "| degrees | elements | REDUCED | p + 1 through | 2 x p through | p + 1 "// &
      "across | p - 1 along, p + 1 through | FULL |"//feed// &
      "|---|---|---:|---:|---:|---:|---:|---:|"//feed
  end function introduction

  !> Modes that the rules leave on one patch.
  function row(degrees, n_elements) result(text)
    integer, intent(in) :: degrees(3), n_elements(3)
    character(:), allocatable :: text
    type(rule_t) :: rules(6)
    type(projection_spec_t) :: plain
    integer :: r, n_points(3)

    rules(2)%more(3) = 1
    rules(3)%parts(3) = 2
    rules(4)%more(2) = 1
    rules(5)%more = [-1, 0, 1]
    rules(6)%more = 1
    text = "| "//list_of(degrees)//" | "//elements_of(n_elements)//" |"
    do r = 1, size(rules)
      n_points = degrees + rules(r)%more
      if (any(n_points < 1)) then
        text = text//" |"
      else
        text = text//" "//to_text(n_spurious_modes(degrees, n_elements, n_points, &
                                                   rules(r)%parts, plain))//" |"
      end if
    end do
    text = text//feed
  end function row

  function list_of(numbers) result(text)
    integer, intent(in) :: numbers(3)
    character(:), allocatable :: text

    text = to_text(numbers(1))//", "//to_text(numbers(2))//", "//to_text(numbers(3))
  end function list_of

  !> Numbers of elements, those above 1 as `n`.
  function elements_of(numbers) result(text)
    integer, intent(in) :: numbers(3)
    character(:), allocatable :: text
    integer :: axis

    text = ""
    do axis = 1, 3
      if (axis > 1) text = text//" x "
      if (numbers(axis) > 1) then
        text = text//"n"
      else
        text = text//"1"
      end if
    end do
  end function elements_of

end module rule_manual
